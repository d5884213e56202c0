"""What WebMap costs, measured against others and against other ways to do it."""
