"""Recordings: bags of ROS 1 and ROS 2 that are played, and that are written.

A recording that is played stands in for a rosbridge and the robots behind it, as the
simulator does. What is here knows nothing of the display, and nobody else knows
rosbags, which is installed with ``webmap[bags]``.
"""

from importlib.util import find_spec

from webmap.base.errors import ConfigError


def need_rosbags() -> None:
    """Go on if bags can be read and written here.

    Raises:
        ConfigError: If rosbags is not installed.

    """
    if find_spec("rosbags") is None:
        raise ConfigError(
            "bags are read and written by rosbags, which is not installed: "
            'pip install "webmap[bags]"'
        )
