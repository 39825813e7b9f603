"""Program: compare planners by what they place where. Run ``python -m mskgrasp.benchmark --help``."""
