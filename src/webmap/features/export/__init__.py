"""Export: the map as an SVG or PNG file.

Open ``export_tool.js`` first; the work is done in the browser.
"""
