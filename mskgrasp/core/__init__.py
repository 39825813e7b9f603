"""Geometry, grasps, errors, configuration and settings: the foundation of all other packages."""
