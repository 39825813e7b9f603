"""First grasp: plan, grasp and film an example part in the simulated cell."""
