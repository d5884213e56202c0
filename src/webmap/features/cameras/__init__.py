"""Cameras: pictures and video of a robot from a topic or over HTTP, and their panel.

Open ``camera.py`` first, and ``video_camera.py`` for video. Decoding of images belongs
in ``webmap.ros``; video is decoded by browsers.
"""
