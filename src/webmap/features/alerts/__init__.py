"""Alerts: what needs a person, in one list that all viewers share.

Open ``alerts.py`` first: it has the list, what makes an alert, and the panel of a page.
"""
