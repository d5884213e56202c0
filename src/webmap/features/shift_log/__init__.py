"""The shift log on the page: its panel, and the page that hands over a shift.

Open ``shift_panel.py`` first. The log itself is ``webmap.core.shift_log``.
"""
