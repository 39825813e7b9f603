"""Program: homing of a cell's hand."""
