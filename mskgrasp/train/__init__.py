"""Program: train the networks. Run ``python -m mskgrasp.train --help``."""
