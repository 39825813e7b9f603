"""Program that trains the networks. Run ``python -m mskgrasp.train --help``."""
