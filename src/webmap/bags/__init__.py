"""Recordings: bags of ROS 1 and ROS 2, played and written.

A recording that is played replaces a rosbridge and its robots, as the simulator does.
This is the only folder that uses rosbags, which ``webmap[bags]`` installs. It knows
nothing of the display. Open ``player`` first, then ``playback`` and ``recorder``.
"""

from importlib.util import find_spec

from webmap.base.errors import ConfigError


def need_rosbags() -> None:
    """Raise an error if bags cannot be read and written here.

    Raises:
        ConfigError: If rosbags is not installed.

    """
    if find_spec("rosbags") is None:
        raise ConfigError(
            "bags are read and written by rosbags, which is not installed: "
            'pip install "webmap[bags]"'
        )
