"""Robots whose nodes use rmw_zenoh, read through their Zenoh router; nothing is sent.

``link`` is what a :class:`webmap.Bridge` uses; open it first. ``graph`` reads the
liveliness tokens, in which nodes announce their topics, without I/O. ``messages`` has
the messages, and the hashes by which definitions of types are compared.
"""
