"""Program: parts, datasets, plans and trials in 3-D. Run ``python -m mskgrasp.view --help``."""
