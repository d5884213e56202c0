"""The gate's sockets to the bridges. The rules decide; nothing is decided here.

Start with ``lane``, then read ``control``, which writes velocity.
"""
