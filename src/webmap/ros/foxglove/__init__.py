"""The Foxglove WebSocket protocol: robots behind a ``foxglove_bridge``.

``link`` is what a :class:`webmap.Bridge` uses; open it first. ``session`` is one
connection with what the server offers on it, ``calls`` and ``graph`` ask it, and
``messages`` reads and writes messages by their schemas. ``protocol`` has the frames,
without I/O. ``as_rosbridge`` carries out the operations of rosbridge, for agents.
``advice`` is the part of ``webmap doctor`` that holds for a Foxglove bridge alone.
"""
