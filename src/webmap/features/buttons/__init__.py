"""Buttons of robots: a button on the page calls a service or publishes a message.

Open ``buttons.py`` first. The settings of a button are in ``webmap.config.buttons``.
"""
