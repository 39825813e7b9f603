"""Program: assess how precisely parts can be grasped. Run ``python -m mskgrasp.assess --help``."""
