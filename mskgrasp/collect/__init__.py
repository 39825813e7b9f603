"""Program: collect a dataset of simulated grasps. Run ``python -m mskgrasp.collect --help``."""
