"""Program: grasp parts and place them at targets. Run ``python -m mskgrasp.palletize --help``."""
