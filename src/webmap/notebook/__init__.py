"""The map in notebooks, by anywidget: for looking only, without a server.

``widget.py`` has the widget and the pages of its views, and ``widget.js`` what shows
them in the browser. The connection is that of the notebook to its kernel.
"""
