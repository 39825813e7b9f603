"""Program: record a cell. Run ``python -m hal.record --help``."""
