"""One grasp attempt: motion, clearance, outcome."""
