"""Program: home a cell's hand. Run ``python -m hal.home --help``."""
