"""A ROS system as the rest of WebMap sees it: topics, messages and services.

``bridge`` is the link to one system and ``subscriptions`` its listeners; open these two
first. ``messages`` are typed views of messages. How a link speaks over its sockets is
known to ``rosbridge`` alone.
"""
