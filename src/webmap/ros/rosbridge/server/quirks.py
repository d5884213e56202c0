"""Behaviour of real rosbridge servers that differs from the protocol text."""

from dataclasses import dataclass, fields, replace

from webmap.base.errors import ConfigError


@dataclass(frozen=True, slots=True)
class Quirks:
    """Differences from the protocol text; without any the server follows it."""

    silent: bool = False
    """A bad request is never answered; the protocol has ``op: status``."""

    bare_nan: bool = False
    """NaN in a fixed array (a covariance) is written as the token ``NaN``."""

    no_fixed_array_cbor: bool = False
    """A message with a fixed array (Odometry) is never sent as CBOR."""

    no_png: bool = False
    """A subscription with compression png gets no messages."""

    no_cbor_fragments: bool = False
    """CBOR with a fragment size is never sent."""

    no_large_cbor: bool = False
    """CBOR above ``max_message_size`` is logged and never sent; JSON comes in parts."""

    float_fragments: bool = False
    """The total of fragments is a float, and publications share the id 0."""

    escaped_slashes: bool = False
    r"""JSON has ``\/`` for every slash, as written by the ujson library."""

    lenient_numbers: bool = False
    """NaN, Infinity and 1e999 from a client reach the robot."""

    blocking_services: bool = False
    """A service call blocks other messages of its connection until it is answered."""

    blocking_goals: bool = False
    """An action goal blocks other messages of its connection until it ends."""

    hanging_param_names: bool = False
    """``/rosapi/get_param_names`` never answers; afterwards rosapi never answers."""

    deadly_message_details: bool = False
    """``/rosapi/message_details`` never answers, and rosapi ends."""

    spinning_queue: bool = False
    """The server hangs for ever when certain subscriptions end, in any way.

    These have a ``throttle_rate`` of 0, a ``queue_length`` above 0, and have got a
    message. rosbridge 2.1.0 hangs only if a message is queued at that moment. A test
    cannot time that, so here a message always is.
    """

    hanging_stop: bool = False
    """``/robot_N/stop`` never answers. No real server does this; it is a fault."""


POLITE = Quirks()
REAL = {
    "ros1": Quirks(
        silent=True,
        no_fixed_array_cbor=True,
        no_cbor_fragments=True,
        float_fragments=True,
        escaped_slashes=True,
        lenient_numbers=True,
    ),
    "ros2": Quirks(
        silent=True,
        bare_nan=True,
        no_fixed_array_cbor=True,
        no_png=True,
        no_cbor_fragments=True,
        no_large_cbor=True,
        float_fragments=True,
        escaped_slashes=True,
        lenient_numbers=True,
        spinning_queue=True,
        blocking_services=True,
        blocking_goals=True,
        hanging_param_names=True,
        deadly_message_details=True,
    ),
}
"""The measured behaviour of rosbridge 0.11.17 (ROS 1) and 2.1.0 (ROS 2)."""


def parse_quirks(text: str, dialect: str) -> Quirks:
    """Return the quirks that ``text`` names.

    Args:
        text: ``real`` or ``polite``, then any number of ``,NAME`` to add a quirk or
            ``,-NAME`` to remove one: ``polite,bare_nan`` or ``real,-silent``.
        dialect: ``ros1`` or ``ros2``; selects the quirks of ``real``.

    Raises:
        ConfigError: If the text contains another name.

    """
    base, *changes = (part.strip() for part in text.split(","))
    if base not in ("real", "polite"):
        raise ConfigError(f"quirks must begin with 'real' or 'polite', got {text!r}")
    known = [field.name for field in fields(Quirks)]
    quirks = REAL[dialect] if base == "real" else POLITE
    for change in changes:
        name = change.removeprefix("-")
        if name not in known:
            raise ConfigError(f"no quirk is called {name!r}; there are {known}")
        quirks = replace(quirks, **{name: not change.startswith("-")})
    return quirks
