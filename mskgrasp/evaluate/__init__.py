"""Program: the paper's experiments on any cell. Run ``python -m mskgrasp.evaluate --help``."""
