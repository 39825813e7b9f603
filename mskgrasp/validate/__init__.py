"""Program: test simulated labels. Run ``python -m mskgrasp.validate --help``."""
