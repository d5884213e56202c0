"""The Foxglove WebSocket protocol: robots behind a ``foxglove_bridge``.

``protocol`` has the frames, without I/O.
"""
