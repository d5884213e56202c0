"""The rosbridge v2 protocol: the only folder that knows its operations and its quirks.

``link`` is what a :class:`webmap.Bridge` uses; open it first. ``ops`` builds the
operations that a client sends and ``protocol`` reads those that a bridge sends;
``wire_subscription`` keeps the subscription to one topic. ``graph`` asks rosapi.
``checks`` and ``advice`` are the part of ``webmap doctor`` that holds for rosbridge
alone. ``server`` is the other side of the protocol, for the simulator and for
recordings.
"""
