"""Files that outlive the gate: active STOPs, results of stop tests, lock files.

Open ``disk`` first. What the files mean is decided in ``webmap.gate.rules``.
"""
