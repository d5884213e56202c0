"""The diagnosis of a bridge on the page.

Open ``doctor_panel.py`` first. The rules of the diagnosis are in
``webmap.discovery.doctor``.
"""
