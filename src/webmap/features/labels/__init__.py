"""Labels: named places on the map, which admins add, move and remove.

Open ``labels.py`` first; ``label_store.py`` reads and writes the files.
"""
