"""Bytes between the display and a page, without any socket.

Open ``session`` first, which is the state of one page; ``messages`` are read from the
page, and ``encode`` makes the frames for it.
"""
