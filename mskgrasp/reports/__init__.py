"""Sections of reports, shown as an HTML page or on the console, and the style of figures."""
