"""Player: the bar that pauses, seeks and speeds up a recording that is shown.

Open ``player_bar.js`` first. The recording itself is played by ``webmap.bags``, in a
process of its own.
"""
