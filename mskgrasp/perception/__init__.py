"""Parts, heights and markers in depth and colour images."""
