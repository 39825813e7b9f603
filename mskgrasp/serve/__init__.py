"""Program: answer requests for grasps over HTTP. Run ``python -m mskgrasp.serve --help``."""
