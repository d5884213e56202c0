"""The STOP buttons.

Open ``stop_button.py`` first. The gate decides and keeps STOP.
"""
