"""One button of a robot: what it does, and how far that is, for everybody who looks."""

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from webmap.core.button_run import NotDone, run
from webmap.core.button_spec import ButtonSpec
from webmap.ros.asked_definitions import ask_definitions, lookup_in
from webmap.ros.bridge import Bridge
from webmap.ros.form_fields import Field, fields_of
from webmap.ros.message_forms import checked
from webmap.scope import Removable, Removal, keep

if TYPE_CHECKING:
    from webmap.core.robot import Robot

log = logging.getLogger("webmap.buttons")

State = Literal["idle", "running", "done", "failed"]

PROGRAM = "this program"
"""Who presses, where nobody's hand does."""


class RobotButton:
    """A button, whoever presses it: it runs once at a time, and all see how it goes.

    Args:
        robot: The robot that it is on.
        bridge: The link to the robot's ROS system.
        spec: What it does.

    """

    def __init__(self, robot: "Robot", bridge: Bridge, spec: ButtonSpec) -> None:
        self.robot = robot
        self.spec = spec
        self.state: State = "idle"
        self.words = ""
        """What came of the last press; empty before the first."""
        self.by = ""
        """Who pressed last."""
        self.since = 0.0
        """When that was, in monotonic seconds."""
        self._bridge = bridge
        self._fields: Sequence[Field] | None = None
        self._listeners: list[Callable[[], None]] = []

    def __repr__(self) -> str:
        return f"<RobotButton {self.spec.label!r} of {self.robot.name!r} {self.state}>"

    @property
    def barred(self) -> str | None:
        """Why it cannot be pressed now, in words; None if it can."""
        if self.state == "running":
            return f"it runs already, for {self.by}"
        report = self.robot.report
        if report is not None and report.latched and not self.spec.during_stop:
            return "STOP stands: reset it first"
        return None

    def on_change(self, fn: Callable[[], None]) -> Removable:
        """Call ``fn`` whenever the state changes, until the current scope ends."""
        self._listeners.append(fn)
        return keep(Removal(lambda: self._listeners.remove(fn)))

    def notify(self) -> None:
        """Tell who looks that something about it is different."""
        for fn in tuple(self._listeners):
            fn()

    @property
    def ros2(self) -> bool:
        """Whether its type is written as ROS 2 has it."""
        return (self.spec.type or "").count("/") == 2

    async def press(self, values: Any = None, *, by: str = PROGRAM) -> bool:
        """Do what the button does; return whether that succeeded.

        Args:
            values: The fields to send, or the parameter's value; those of the
                configuration if not given.
            by: Who presses, for people and for the log.

        """
        why = self.barred
        if why is not None:
            if self.state != "running":
                self._become("failed", f"Not done: {why}", by)
            return False
        self._become("running", "", by)
        log.info("%s: %s pressed %r", self.robot.name, by, self.spec.label)
        try:
            if values is None:
                values = self._configured()
            words = await run(self._bridge, self.spec, values)
        except NotDone as error:
            words = f"Failed: {error}"
            log.warning("%s: %s: %s", self.robot.name, self.spec.label, words)
            self._become("failed", words, by)
            return False
        except BaseException:
            self._become("failed", "Failed: it was broken off", by)
            raise
        self._become("done", words, by)
        return True

    def fields(self) -> Sequence[Field]:
        """Return the fields of what it sends, for a form.

        Raises:
            UnknownType: If their definition is not shipped and was not asked for.

        """
        if self.spec.kind == "parameter":
            return [_field_of_value(self.spec.value)]
        if self._fields is None:
            assert self.spec.type is not None, "a form has a type"
            self._fields = fields_of(self.spec.type)
        return self._fields

    async def ask_fields(self) -> None:
        """Ask the robot for the fields, if it is one of ROS 1.

        Raises:
            BridgeError: If it may not be asked, or does not tell.
            ConfigError: If what it tells makes no sense.

        """
        assert self.spec.type is not None, "a form has a type"
        kind = "srv" if self.spec.kind == "service" else "msg"
        texts = await ask_definitions(self._bridge, self.spec.type, kind)
        self._fields = fields_of(self.spec.type, lookup_in(texts))

    def _configured(self) -> Any:
        if self.spec.kind == "parameter":
            return self.spec.value
        if self.spec.type is None:
            return self.spec.values
        try:
            fields = self.fields()
        except ValueError:  # nobody knows its fields: sent as it stands
            return self.spec.values
        return checked(fields, self.spec.values, ros2=self.ros2)

    def _become(self, state: State, words: str, by: str) -> None:
        self.state, self.words, self.by = state, words, by
        self.since = time.monotonic()
        self.notify()


def values_of(spec: ButtonSpec) -> Mapping[str, Any]:
    """Return what a form begins with."""
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
