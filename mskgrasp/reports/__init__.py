"""Figures of grasps and HTML reports."""
