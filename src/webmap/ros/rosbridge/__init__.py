"""The rosbridge v2 protocol: the only room that knows its operations and its quirks.

``link`` is what a :class:`webmap.Bridge` has behind it; open it first. ``ops`` builds
what a client sends and ``protocol`` reads what a bridge sends; ``connection`` keeps a
WebSocket open, and ``wire_subscription`` knows what was asked for one topic. ``graph``
asks rosapi. ``checks`` and ``advice`` are the part of ``webmap doctor`` that holds for
rosbridge alone. ``server`` is the other side of the protocol, for the simulator and for
recordings.
"""
