"""The log of robots (``/rosout``) and its panel.

Open ``rosout.py`` for receiving, ``rosout_panel.py`` for the panel.
"""
