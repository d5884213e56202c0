"""Measuring distances on the map.

Open ``measure_tool.js`` first; the work is done in the browser.
"""
