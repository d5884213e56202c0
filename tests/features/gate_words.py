"""The gate's messages to a page on a busy machine."""

import re

TOO_LATE = re.compile(
    "older than|too old|does not respond|take control first|too slow|"
    "control of the robot"
)
"""Why a goal was refused that the gate accepts when it is sent again."""
