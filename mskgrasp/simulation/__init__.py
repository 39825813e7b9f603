"""Shards of simulated grasp attempts, their description, and the versions of what makes them."""
