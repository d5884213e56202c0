"""WebMap."""
