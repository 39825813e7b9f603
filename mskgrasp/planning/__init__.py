"""Grasp planner, and placing of the grasped part."""
