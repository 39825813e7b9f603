"""Commands of ``python -m mskgrasp.parts``."""
