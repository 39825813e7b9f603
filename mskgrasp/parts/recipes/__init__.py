"""Recipes of the built-in parts."""
