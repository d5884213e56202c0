"""What a press of a button does on the robot, and what came of it, in words."""

import json
from collections.abc import Mapping
from typing import Any

from webmap.core.button_spec import ButtonSpec, declared_motion, motion_of
from webmap.core.parameter_values import value_kind
from webmap.errors import BridgeError, MotionRefused, ServiceError, WebMapError
from webmap.ros.bridge import Bridge
from webmap.ros.names import same_type

MAX_WORDS = 300
"""Characters of what is said of a result."""

ROSAPI_PATIENCE = 2.0
"""Seconds for rosapi to say which type a service has."""


class NotDone(WebMapError):
    """A button did not do what it is there for; the text says why, to people."""


async def run(bridge: Bridge, spec: ButtonSpec, values: Any) -> str:
    """Do what a button does.

    Args:
        bridge: The link.
        spec: What it does.
        values: The fields to send, or the parameter's value.

    Returns:
        What came of it, in words.

    Raises:
        NotDone: If it failed, was refused, or nobody answered in time.

    """
    try:
        await _refuse_motion(bridge, spec)
        if spec.kind == "service":
            return await _call(bridge, spec, values)
        if spec.kind == "topic":
            bridge.publish(spec.name, values, spec.type)
            return "Published"
        if spec.node is None:
            return await _set_ros1(bridge, spec, values)
        return await _set_ros2(bridge, spec, values)
    except NotDone:
        raise
    except MotionRefused as error:
        raise NotDone(f"refused: {error}") from None
    except (WebMapError, ValueError, TypeError) as error:
        raise NotDone(shortened(str(error))) from None


async def _refuse_motion(bridge: Bridge, spec: ButtonSpec) -> None:
    """Look again, now that robots are declared and the robot tells its types.

    Raises:
        MotionRefused: If it would move a robot.
        NotDone: If the robot has another type than was said.

    """
    found = await _type_on_robot(bridge, spec)
    for type in (spec.type, found):
        why = motion_of(spec.kind, spec.name, type)
        if why is not None:
            raise MotionRefused(why)
    why = declared_motion(spec, bridge.url)
    if why is not None:
        raise MotionRefused(why)
    if found and spec.type and not same_type(found, spec.type):
        raise NotDone(f"{spec.name} is of type {found}, not of {spec.type}")


async def _type_on_robot(bridge: Bridge, spec: ButtonSpec) -> str | None:
    if spec.kind == "topic":
        return await bridge.topic_type(spec.name)
    if spec.kind == "parameter":
        return None
    try:
        answer = await bridge.call_service(
            "/rosapi/service_type", {"service": spec.name}, timeout=ROSAPI_PATIENCE
        )
    except BridgeError:  # without rosapi nobody knows
        return None
    found = answer.get("type") if isinstance(answer, Mapping) else None
    return found if isinstance(found, str) and found else None


async def _call(bridge: Bridge, spec: ButtonSpec, values: Mapping[str, Any]) -> str:
    answer = await bridge.call_service(
        spec.name, values, type=spec.type, timeout=spec.timeout
    )
    return answered(answer)


async def _set_ros1(bridge: Bridge, spec: ButtonSpec, value: Any) -> str:
    name = spec.name
    await bridge.call_service(
        "/rosapi/set_param",
        {"name": name, "value": json.dumps(value, ensure_ascii=False)},
        timeout=spec.timeout,
    )
    # rosapi says nothing of a parameter that it may not set, so look.
    answer = await bridge.call_service(
        "/rosapi/get_param", {"name": name, "default": ""}, timeout=spec.timeout
    )
    text = answer.get("value") if isinstance(answer, Mapping) else None
    try:
        now = json.loads(text) if isinstance(text, str) else None
    except ValueError:
        now = text
    if now != value:
        raise NotDone(
            f"{name} was to be {shown(value)}, and the robot says {shown(now)}"
        )
    return f"{name} is {shown(value)}"


async def _set_ros2(bridge: Bridge, spec: ButtonSpec, value: Any) -> str:
    number, field = value_kind(value)
    parameter = {"name": spec.name, "value": {"type": number, field: value}}
    answer = await bridge.call_service(
        f"{spec.node}/set_parameters",
        {"parameters": [parameter]},
        type="rcl_interfaces/srv/SetParameters",
        timeout=spec.timeout,
    )
    results = answer.get("results") if isinstance(answer, Mapping) else None
    first = results[0] if isinstance(results, list) and results else None
    if not isinstance(first, Mapping) or "successful" not in first:
        raise ServiceError(f"{spec.node}/set_parameters answered nothing to the point")
    if first["successful"] is not True:
        reason = str(first.get("reason") or "no reason was given")
        raise NotDone(shortened(f"{spec.node} refused: {reason}"))
    return f"{spec.name} is {shown(value)}"


def answered(answer: Any) -> str:
    """Return in words what a service answered.

    Raises:
        NotDone: If it says ``success: false``.

    """
    if not isinstance(answer, Mapping):
        return "Done"
    said = str(answer.get("message") or answer.get("status_message") or "")
    if answer.get("success") is False:
        raise NotDone(shortened(said or "the robot says that it did not succeed"))
    if said:
        return shortened(f"Done: {said}")
    rest = {name: value for name, value in answer.items() if name != "success"}
    words = ", ".join(f"{name} {shown(value)}" for name, value in rest.items() if value)
    return shortened(f"Done: {words}") if words else "Done"


def shown(value: Any) -> str:
    """Return a value as people read it."""
    if value is None:
        return "nothing"
    if isinstance(value, str):
        return value
    return json.dumps(value, ensure_ascii=False, default=str)


def shortened(text: str) -> str:
    """Return a text without what no screen shows, at most so long."""
    plain = "".join(c if c.isprintable() else " " for c in text)
    return plain if len(plain) <= MAX_WORDS else f"{plain[: MAX_WORDS - 3]}..."
