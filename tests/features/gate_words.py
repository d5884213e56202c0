"""What the gate says to a page that a busy machine held up."""

import re

TOO_LATE = re.compile(
    "older than|too old|does not respond|take control first|too slow|"
    "control of the robot"
)
"""Why a goal was not taken that is taken when it is sent again."""
