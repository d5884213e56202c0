"""One button of a robot: its action and the state of its press, for all pages."""

import json
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

from webmap.base.errors import MotionRefused, ServiceError, WebMapError
from webmap.base.scope import Removable, Removal, keep
from webmap.config.buttons import ButtonConfig, motion_of, value_kind
from webmap.core.motion import robot_motions
from webmap.core.operators import Operator
from webmap.core.robot import Robot
from webmap.core.shift_log import shift_log
from webmap.ros.bridge import Bridge
from webmap.ros.definitions import Field
from webmap.ros.message_forms import checked, fields_of
from webmap.ros.names import same_type

log = logging.getLogger("webmap.buttons")

State = Literal["idle", "running", "done", "failed"]

PROGRAM = "this program"
"""Who presses, if a program does."""

MAX_TEXT = 300
"""The greatest number of characters of a result's text."""


class RobotButton:
    """A button shared by all pages: one press runs at a time, and all pages show it.

    Args:
        robot: The robot of the button.
        bridge: The bridge of the robot's ROS system.
        spec: The action.
    """

    def __init__(self, robot: Robot, bridge: Bridge, spec: ButtonConfig) -> None:
        self.robot = robot
        self.spec = spec
        self.state: State = "idle"
        self.result = ""
        """The result of the last press; empty before the first."""
        self.by: Operator | str = ""
        """Who pressed last."""
        self.since = 0.0
        """Time of the last press, in monotonic seconds."""
        self._bridge = bridge
        self._fields: Sequence[Field] | None = None
        self._listeners: list[Callable[[], None]] = []

    def __repr__(self) -> str:
        return f"<RobotButton {self.spec.label!r} of {self.robot.name!r} {self.state}>"

    @property
    def why_disabled(self) -> str | None:
        """Why the button cannot be pressed now, as text; None if it can."""
        if self.state == "running":
            return f"already running, started by {self.by}"
        report = self.robot.report
        if report is not None and report.latched and not self.spec.during_stop:
            return "STOP is active: reset it first"
        return None

    def on_change(self, fn: Callable[[], None]) -> Removable:
        """Call ``fn`` whenever the state changes, until the current scope ends."""
        self._listeners.append(fn)
        return keep(Removal(lambda: self._listeners.remove(fn)))

    def notify(self) -> None:
        """Notify all listeners that the state has changed."""
        for fn in tuple(self._listeners):
            fn()

    @property
    def ros2(self) -> bool:
        """Whether the type is written in the ROS 2 dialect."""
        return (self.spec.type or "").count("/") == 2

    async def press(self, values: Any = None, *, by: Operator | str = PROGRAM) -> bool:
        """Run the action; return whether it succeeded.

        Args:
            values: The fields to send, or the parameter's value; those of the
                configuration if not given.
            by: Who presses, for people and for the log.
        """
        why = self.why_disabled
        if why is not None:
            if self.state != "running":
                self._become("failed", f"Not done: {why}", by)
            return False
        self._become("running", "", by)
        who = by.logged if isinstance(by, Operator) else by
        log.info("%s: %s pressed %r", self.robot.name, who, self.spec.label)
        try:
            if values is None:
                values = self._configured()
            words = await run(self._bridge, self.spec, values)
        except ButtonFailed as error:
            words = f"Failed: {error}"
            log.warning("%s: %s: %s", self.robot.name, self.spec.label, words)
            self._become("failed", words, by)
            return False
        except BaseException:
            self._become("failed", "Failed: cancelled", by)
            raise
        self._become("done", words, by)
        return True

    def fields(self) -> Sequence[Field]:
        """Return the fields of the message to send, for a form.

        Raises:
            UnknownType: If WebMap does not contain the definition and the robot was not
                asked for it.
        """
        if self.spec.kind == "parameter":
            return [_field_of_value(self.spec.value)]
        if self._fields is None:
            assert self.spec.type is not None, "a form has a type"
            self._fields = fields_of(self.spec.type)
        return self._fields

    async def ask_fields(self) -> None:
        """Ask the robot for the fields, if the robot runs ROS 1.

        Raises:
            BridgeError: If the request is not allowed, or the robot does not answer.
            ConfigError: If the answer is not valid.
        """
        assert self.spec.type is not None, "a form has a type"
        kind = "srv" if self.spec.kind == "service" else "msg"
        known = await self._bridge.definitions(self.spec.type, kind)
        self._fields = fields_of(self.spec.type, known)

    def _configured(self) -> Any:
        if self.spec.kind == "parameter":
            return self.spec.value
        if self.spec.type is None:
            return self.spec.values
        try:
            fields = self.fields()
        except ValueError:  # unknown fields: sent as configured
            return self.spec.values
        return checked(fields, self.spec.values, ros2=self.ros2)

    def _become(self, state: State, words: str, by: Operator | str) -> None:
        self.state, self.result, self.by = state, words, by
        self.since = time.monotonic()
        if state != "running":
            text = f"{self.spec.label}: {words}"
            shift_log.note("button", text, robot=self.robot, person=by)
        self.notify()


def values_of(spec: ButtonConfig) -> Mapping[str, Any]:
    """Return the initial values of a form."""
    return {"value": spec.value} if spec.kind == "parameter" else spec.values


def _field_of_value(value: Any) -> Field:
    for cls, type in (
        (bool, "bool"),
        (int, "int64"),
        (float, "float64"),
        (str, "string"),
    ):
        if isinstance(value, cls):
            return Field("value", type)
    raise AssertionError("a form of a parameter has one value")


class ButtonFailed(WebMapError):
    """A button's action failed; the text explains the reason to people."""


def declared_motion(spec: ButtonConfig, url: str) -> str | None:
    """Return why a button may not act on the declared motion topics of robots.

    Args:
        spec: The button's action.
        url: The address of its bridge.
    """
    if spec.kind == "parameter":
        return None
    for motion in list(robot_motions):
        carried = motion.writes(url).get(spec.name)
        if carried is not None:
            return (
                f"{spec.name} carries {carried}, which only the gate publishes: "
                "remove this button"
            )
    return None


async def run(bridge: Bridge, spec: ButtonConfig, values: Any) -> str:
    """Run a button's action.

    Args:
        bridge: The bridge.
        spec: The action.
        values: The fields to send, or the parameter's value.

    Returns:
        The result, as text.

    Raises:
        ButtonFailed: If the action failed, was refused, or was not answered in time.
    """
    try:
        await _refuse_motion(bridge, spec)
        if spec.kind == "service":
            answer = await bridge.call_service(
                spec.name, values, type=spec.type, timeout=spec.timeout
            )
            return answer_text(answer)
        if spec.kind == "topic":
            bridge.publish(spec.name, values, spec.type)
            return "Published"
        if spec.node is None:
            return await _set_ros1(bridge, spec, values)
        return await _set_ros2(bridge, spec, values)
    except ButtonFailed:
        raise
    except MotionRefused as error:
        raise ButtonFailed(f"refused: {error}") from None
    except (WebMapError, ValueError, TypeError) as error:
        raise ButtonFailed(short_text(str(error))) from None


async def _refuse_motion(bridge: Bridge, spec: ButtonConfig) -> None:
    """Check again, because robots are declared and the robot's types are known now.

    Raises:
        MotionRefused: If it would move a robot.
        ButtonFailed: If the robot's type differs from the configured type.
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
        raise ButtonFailed(f"{spec.name} is of type {found}, not of {spec.type}")


async def _type_on_robot(bridge: Bridge, spec: ButtonConfig) -> str | None:
    if spec.kind == "topic":
        return await bridge.topic_type(spec.name)
    if spec.kind == "parameter":
        return None
    return await bridge.service_type(spec.name)


async def _set_ros1(bridge: Bridge, spec: ButtonConfig, value: Any) -> str:
    name = spec.name
    now = await bridge.set_parameter(name, value, timeout=spec.timeout)
    if now != value:
        raise ButtonFailed(
            f"got {value_text(now)} for {name} from the robot, expected "
            f"{value_text(value)}"
        )
    return f"{name} is {value_text(value)}"


async def _set_ros2(bridge: Bridge, spec: ButtonConfig, value: Any) -> str:
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
        raise ServiceError(f"{spec.node}/set_parameters gave no usable answer")
    if first["successful"] is not True:
        reason = str(first.get("reason") or "no reason was given")
        raise ButtonFailed(short_text(f"{spec.node} refused: {reason}"))
    return f"{spec.name} is {value_text(value)}"


def answer_text(answer: Any) -> str:
    """Return a service's answer as text.

    Raises:
        ButtonFailed: If the answer has ``success: false``.
    """
    if not isinstance(answer, Mapping):
        return "Done"
    message = str(answer.get("message") or answer.get("status_message") or "")
    if answer.get("success") is False:
        raise ButtonFailed(short_text(message or "the robot reports no success"))
    if message:
        return short_text(f"Done: {message}")
    rest = {name: value for name, value in answer.items() if name != "success"}
    words = ", ".join(
        f"{name} {value_text(value)}" for name, value in rest.items() if value
    )
    return short_text(f"Done: {words}") if words else "Done"


def value_text(value: Any) -> str:
    """Return a text as it is, any other value as JSON, and None as "nothing"."""
    if value is None:
        return "nothing"
    if isinstance(value, str):
        return value
    return json.dumps(value, ensure_ascii=False, default=str)


def short_text(text: str) -> str:
    """Return a text without unprintable characters, cut to ``MAX_TEXT``."""
    plain = "".join(c if c.isprintable() else " " for c in text)
    return plain if len(plain) <= MAX_TEXT else f"{plain[: MAX_TEXT - 3]}..."
