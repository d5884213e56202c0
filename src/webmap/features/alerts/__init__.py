"""Alerts: what needs a person, in one list that all viewers share.

Open ``alerts.py`` for the list, ``alert_watch.py`` for what makes an alert,
``alert_panel.py`` for the panel of a page.
"""
