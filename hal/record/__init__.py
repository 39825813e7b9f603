"""Program: recording of a cell. Run ``python -m hal.record --help``."""
