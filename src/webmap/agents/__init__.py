"""Robots whose gate runs beside them: agents, and the displays that use them.

An agent runs on the robot's computer or near it. It has the gate, the robot's bridge
and the robot's limits, and connects to a Zenoh router; it listens on nothing. Displays
reach the agent through the router.

Open ``gates`` first: all gates that a process uses. For the gates, ``gate_messages``
has what is sent, ``displays`` the agent's side and ``remote_gate`` the display's. For
the robot's data, these are ``data_messages``, ``bridge_proxy`` and ``link``; for
cameras over HTTP, ``camera_messages``, ``agent_cameras`` and ``remote_camera``.
``peer`` has the sessions with the router, ``router_access`` the user, and ``address``
the keys. ``announcements`` make agents and their robots known. ``router`` is the
configuration of a router in this process.
"""
