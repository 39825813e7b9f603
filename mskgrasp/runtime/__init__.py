"""Command lines, worker processes and run folders."""
