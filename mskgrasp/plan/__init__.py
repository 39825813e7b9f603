"""Program: plan one grasp. Run ``python -m mskgrasp.plan --help``."""
