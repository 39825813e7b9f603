"""Grasp planning and placing."""
