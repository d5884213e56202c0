"""The log of robots (``/rosout``) and its panel.

Open ``rosout.py`` first, which has the modules of both.
"""
