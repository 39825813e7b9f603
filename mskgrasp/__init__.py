"""Grasps of industrial parts that are robust, precise, and know how the part will shift."""

__version__ = "0.1.0"
