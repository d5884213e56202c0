"""The display's end of the pipe to the gate: it starts, watches and uses the gate.

Start with ``client``. This is the only part of the gate that runs in the display's
process.
"""
