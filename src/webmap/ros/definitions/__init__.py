"""The message and service types that forms know without asking a robot.

They are kept as ROS has them, in the language of ``.msg`` and ``.srv`` files, for the
packages that buttons are about. A type that is not here has to be asked of the robot.
"""

from functools import cache
from importlib.resources import files

from webmap.ros.names import split_type

FILES = ("messages.txt", "services.txt")


@cache
def shipped() -> dict[str, str]:
    """Return the text of each type, by its name as ROS 1 writes it."""
    found: dict[str, str] = {}
    for name in FILES:
        text = files(__name__).joinpath(name).read_text("utf-8")
        for part in text.split("### ")[1:]:
            head, _, body = part.partition("\n")
            found[head.strip()] = body
    return found


def definition(type: str) -> str | None:
    """Return the text of a type in either dialect; None if it is not shipped.

    Raises:
        ConfigError: If the text is not the name of a type.

    """
    return shipped().get(str(split_type(type)))
