"""Solids: meshes, convex pieces, measurements and stable poses."""
