"""Recordings: bags of ROS 1 and ROS 2, played and written.

A recording that is played replaces a rosbridge and its robots, as the simulator does.
This is the only folder that uses rosbags, which ``webmap[bags]`` installs, and
foxglove-sdk, which ``webmap[foxglove]`` installs. It knows nothing of the display.
Open ``player`` first, then ``playback`` and ``recorder``.
"""

from importlib.util import find_spec

from webmap.base.errors import ConfigError


def need_rosbags() -> None:
    """Raise an error if bags cannot be read and written here.

    Raises:
        ConfigError: If rosbags or mcap is not installed.

    """
    for package in ("rosbags", "mcap"):
        if find_spec(package) is None:
            raise ConfigError(
                f"bags are read and written by {package}, which is not installed: "
                f'pip install "webmap[bags]"'
            )


def need_foxglove() -> None:
    """Raise an error if recordings cannot be served to Foxglove here.

    Raises:
        ConfigError: If foxglove-sdk is not installed.

    """
    if find_spec("foxglove") is None:
        raise ConfigError(
            "recordings are served to Foxglove by foxglove-sdk, which is not "
            'installed: pip install "webmap[bags,foxglove]"'
        )
