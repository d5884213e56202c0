"""Robots whose gate runs beside them: agents, and the displays that use them.

An agent runs on the robot's computer or near it. It has the gate, the robot's bridge
and the robot's limits, and connects to a Zenoh router; it listens on nothing. Displays
reach the agent through the router.

Open ``gates`` first: all gates that a display reaches. ``samples`` numbers what is
sent, ``displays`` is the agent's side of the gate and ``far_gate`` the display's.
``clients`` is the agent's side of the data and ``link`` the display's. ``cameras`` and
``far_camera`` are the two sides of cameras over HTTP. ``peer`` has the sessions with
the router, ``present`` finds agents for commands that end.
"""
