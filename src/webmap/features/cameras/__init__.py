"""Cameras: pictures of a robot from a topic or over HTTP, and their panel.

Open ``camera.py`` first. Decoding of images belongs in ``webmap.ros``.
"""
