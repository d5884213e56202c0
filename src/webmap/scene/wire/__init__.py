"""Bytes between the display process and a browser page, without any socket.

Begin with ``session``, which is one page's; ``messages`` are what the page sends, and
``encode`` makes the frames that it gets.
"""
