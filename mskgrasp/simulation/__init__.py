"""Shards of simulated grasp attempts, their description, and the versions that determine them."""
