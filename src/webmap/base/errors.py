"""Every error that WebMap raises on purpose.

::

    WebMapError
    ├── BridgeError            an error of the connection to a ROS system
    │   ├── BridgeClosed       the connection is not open now
    │   ├── ProtocolError      bytes that cannot be read
    │   └── ServiceError       a ROS service failed, or did not respond
    ├── MotionError            a command that the gate refused
    │   ├── NoLease            the sender has no control of the robot
    │   └── MotionRefused      velocity or goals that bypass the gate
    ├── ModuleNotFound         no module of that name
    ├── SceneError             an element or attribute outside the allow-list
    ├── WireError              bytes that are not a message between page and display
    └── ConfigError            an invalid file or argument
"""


class WebMapError(Exception):
    """The base of every error that WebMap raises on purpose."""


class BridgeError(WebMapError):
    """An error of the connection to a ROS system."""


class BridgeClosed(BridgeError):
    """The connection to the ROS system is not open now, and nothing is queued."""

    def __init__(self, text: str, why: str = "") -> None:
        super().__init__(text)
        self.why = why
        """Why the attempt to open it failed, without the address, if known."""


class ProtocolError(BridgeError):
    """Bytes came in that cannot be read."""


class ServiceError(BridgeError):
    """A ROS service responded with a failure, or did not respond in time."""


class MotionError(WebMapError):
    """A command for a robot was refused."""


class NoLease(MotionError):
    """The sender of the command has no control of the robot."""


class MotionRefused(MotionError):
    """A velocity, goal or cancel that bypasses the gate, which alone publishes them."""


class ModuleNotFound(WebMapError, LookupError):
    """No module of that name is registered for this kind of owner."""


class SceneError(WebMapError, ValueError):
    """A tag, an attribute or a position in the tree that the scene does not allow."""


class WireError(WebMapError, ValueError):
    """Bytes that are not a message between a page and the display process."""


class NotAllowed(WebMapError):
    """A person did what only others may do."""


class ConfigError(WebMapError, ValueError):
    """An invalid file or argument; the error message gives valid values."""
