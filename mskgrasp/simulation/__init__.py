"""Simulated grasp attempts and the versions of what makes them."""
