"""Measures the costs of WebMap, compared with other libraries and methods."""
