"""Robots as commands show them: from fleet files, from options and from discovery.

Open ``files.py`` for fleet files and ``watch.py`` for what ``webmap view`` does. The
settings themselves are in ``webmap.config``; the rules that find robots are in
``webmap.discovery``.
"""
