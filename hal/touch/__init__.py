"""Program: measure the table of a cell by touching it. Run ``python -m hal.touch --help``."""
