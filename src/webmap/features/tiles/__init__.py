"""Map tiles: street maps and aerial pictures below the robots.

Open ``tile_layer.py`` first; ``tile_source.py`` reads tiles from folders and MBTiles
files.
"""
