"""Commands of ``python -m mskgrasp.dataset``."""
