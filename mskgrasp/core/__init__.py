"""Geometry, grasps, errors, configuration and settings: what every other room stands on."""
