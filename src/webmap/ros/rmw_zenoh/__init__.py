"""Robots whose nodes use rmw_zenoh, read through their Zenoh router; nothing is sent.

``link`` is what a :class:`webmap.Bridge` uses: a connection that offers the topics of
the router as a Foxglove server would, so that ``foxglove`` reads them. ``offer`` has
what nodes announce in their liveliness tokens, without I/O.
"""
