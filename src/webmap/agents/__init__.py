"""Robots whose gate runs beside them: agents, and the displays that use them.

An agent runs on the robot's computer or near it. It has the gate, the robot's bridge and
the robot's limits, and connects to a Zenoh router; it listens on nothing. Displays reach
the agent through the router. ``samples`` numbers what is sent, ``displays`` is the
agent's side of the gate, ``far_gate`` the display's side.
"""
