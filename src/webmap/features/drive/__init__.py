"""Driving: the panel with speed, state and the on-screen stick.

Open ``teleop.py`` first. The code for keys, gamepads and the stick is in
``web/inputs``, the code that sends commands to the gate in ``web/motion``.
"""
