"""Trials on a cell: looking, planning, grasping, measuring."""
