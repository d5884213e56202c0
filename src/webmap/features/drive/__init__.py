"""Driving: the panel with speed, state and the on-screen stick.

Open ``teleop.py`` first. What reads keys, pads and the stick is in ``web/inputs``, and
what sends commands to the gate in ``web/motion``.
"""
