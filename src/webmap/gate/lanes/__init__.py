"""The gate's sockets to the bridges: what is written to them and read from them.

Open ``lane`` first, then ``control``, which writes velocity. Nothing is decided here.
"""
