"""Grasps of industrial parts that are robust and precise, with a prediction of how the part will shift."""

__version__ = "0.1.0"
