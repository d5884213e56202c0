"""What becomes of a robot when nothing here tells it to stop any more."""

from typing import TYPE_CHECKING

from webmap import html
from webmap.console.words import number, sentence

if TYPE_CHECKING:
    from webmap import Element, Robot

NOBODY_KNOWS = "Nobody knows whether it stops by itself."


class OwnStop:
    """Shows the bound that holds when WebMap, its machine or the link dies.

    Args:
        fastest: What this page drives a robot at, in m/s.

    """

    def __init__(self, fastest: float) -> None:
        self._fastest = fastest
        self._bound = html.span()
        self._how = html.span(class_="how")
        self._test = html.p(class_="test")
        self._test.set("role", "status")
        self.elements: list[Element] = [
            html.dl(
                html.div(
                    html.dt(text="If WebMap dies"),
                    html.dd(self._bound, self._how),
                    class_="own-stop",
                ),
                class_="facts",
            ),
            self._test,
        ]

    def show(self, robot: "Robot") -> None:
        """Show what is known of a robot's own stop, and of the test of it."""
        report = robot.report
        self.elements[0].set(hidden=report is None)
        if report is None:
            self._test.text = ""
            return
        self._bound.text, self._how.text = bound(
            report.stop_time,
            f"tested {report.stop_date or ''}".strip()
            if report.stop_source == "tested"
            else report.stop_source,
            min(report.v, self._fastest),
            report.brake,
        )
        self.elements[0].set("data-tone", "warn" if report.stop_time is None else None)
        test = report.test
        shown = test is not None and test.state != "done"
        self._test.text = f"Stop test: {sentence(test.text)}" if test and shown else ""


def bound(
    stop_time: float | None, source: str | None, v: float, brake: float
) -> tuple[str, str]:
    """Return within what time a robot stands that is told nothing, and how that comes.

    Args:
        stop_time: Seconds after which its base brakes by itself, if that is known.
        source: How it is known; ``None`` if it is not.
        v: The speed in force, in m/s.
        brake: How hard it brakes, in m/s².

    """
    if stop_time is None:
        if source is None:
            return NOBODY_KNOWS, ""
        return "It does not stop by itself.", f" {sentence(source)}"
    braking = v / brake
    return (
        f"stands within {number(stop_time + braking)} s",
        f" {number(stop_time)} s ({source}) + {number(braking)} s of braking "
        f"from {number(v)} m/s",
    )
