"""Program: hand-eye calibration of a cell's camera. Run ``python -m hal.calibrate --help``."""
