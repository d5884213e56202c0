"""WebSockets to bridges, whatever protocol their frames have.

``connection`` keeps one open; open it first. ``websocket`` reads its bytes in the turns
that ``turns`` gives, and ``frame_reader`` finds the messages in them.
"""
