"""The table and the region on it where parts are placed."""

TABLE_Z = 0.0
"""Height of the table, base frame, m."""
Region = tuple[float, float, float, float]
"""x_min, x_max, y_min, y_max on the table, base frame, metres."""
REGION: Region = (0.38, 0.62, -0.12, 0.12)
"""The 24 x 24 cm on the table where parts are placed, base frame, metres."""
