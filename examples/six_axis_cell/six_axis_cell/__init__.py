"""Example backends: a six-axis arm and a depth device."""
