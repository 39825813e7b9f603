"""Import of CAD files."""
