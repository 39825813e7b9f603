"""Evidence that simulated labels are right: ``python -m mskgrasp.validate``."""
