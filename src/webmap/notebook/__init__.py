"""The map in notebooks, by anywidget: for looking only, without a server.

Open ``widget.py`` first. ``views.py`` has the pages of widgets in Python, and
``widget.js`` what shows them. The connection is that of the notebook to its kernel.
"""
