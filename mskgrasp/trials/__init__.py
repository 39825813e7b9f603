"""Trials on a cell: presentation, capture, planning, grasping, measurement."""
