"""Program: plan, grasp and film an example part. Run ``python -m mskgrasp.demo --help``."""
