"""A ROS system as the rest of WebMap sees it: topics, messages and services.

``bridge`` is the connection to one system and ``subscriptions`` its listeners; open
these two first. ``messages`` are typed views of messages. ``link`` lists what a bridge
needs of a kind of link; ``rosbridge``, ``foxglove`` and ``rmw_zenoh`` contain the wire
protocols.
"""
