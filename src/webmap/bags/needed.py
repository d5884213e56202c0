"""The library that reads and writes bags, which not everybody has installed."""

from importlib.util import find_spec

from webmap.errors import ConfigError


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
