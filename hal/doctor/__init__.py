"""Program: check a cell. Run ``python -m hal.doctor --help``."""
