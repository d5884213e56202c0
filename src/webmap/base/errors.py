"""Every error that WebMap raises on purpose.

::

    WebMapError
    ├── BridgeError            a link to a ROS system
    │   ├── BridgeClosed       the link is not open now
    │   ├── ProtocolError      bytes that cannot be understood
    │   └── ServiceError       a ROS service failed, or did not answer
    ├── MotionError            a command that the gate did not take
    │   ├── NoLease            somebody else drives, or nobody took the robot
    │   └── MotionRefused      velocity or goals outside the gate's road
    ├── ModuleNotFound         no module of that name
    ├── SceneError             an element or attribute outside the allow-list
    ├── WireError              bytes that are not a message between page and display
    └── ConfigError            a file or an argument that does not make sense
"""


class WebMapError(Exception):
    """The base of every error that WebMap raises on purpose."""


class BridgeError(WebMapError):
    """Something went wrong on a link to a ROS system."""


class BridgeClosed(BridgeError):
    """The link to the ROS system is not open now, and nothing is queued."""

    why = ""
    """How the attempt to open it failed, without the address, if that is known."""


class ProtocolError(BridgeError):
    """Bytes came in that cannot be understood."""


class ServiceError(BridgeError):
    """A ROS service answered with a failure, or did not answer in time."""


class MotionError(WebMapError):
    """A command for a robot was not taken."""


class NoLease(MotionError):
    """The lease of the robot is not held by the one who gave the command."""


class MotionRefused(MotionError):
    """Velocity, goals and cancel are written by the gate and by nobody else."""


class ModuleNotFound(WebMapError, LookupError):
    """No module of that name is registered for this kind of owner."""


class SceneError(WebMapError, ValueError):
    """A tag, an attribute or a place in the tree that the scene does not allow."""


class WireError(WebMapError, ValueError):
    """Bytes that are not a message between a page and the display process."""


class ConfigError(WebMapError, ValueError):
    """A file or an argument that does not make sense, and what would."""
