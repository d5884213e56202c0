"""The table of promises in docs/safety.md, and five of its lines in README.md.

``python tests/safety/safety_promises.py`` writes both from
``docs/safety-figures.json``; ``make test-safety`` runs it.
"""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from safety_figures import DOCS, Figure

PAGE = DOCS / "safety.md"
README = DOCS.parent / "README.md"
BEGIN, END = "<!-- promises -->\n", "<!-- /promises -->\n"
"""The lines before and after the generated lines in both files."""


class Promise(NamedTuple):
    """A row of the table."""

    number: int
    text: str
    figures: str
    """A pattern for the names of the figures that measure the promise; "" for none."""
    shown_by: str
    """The test of the promise; the figures may come from other tests."""


BUSY = "; a map of 16 million cells.*"
"""The end of the names of figures under load."""

PROMISES = (
    Promise(
        1,
        "a page that fails stops the robot",
        "the (browser|renderer) is (killed|stopped.*)|the page .*"
        "|(half of )?the browser's link (is reset|is closed|stalls .*)",
        "test_a_suspended_browser_stops_the_robot",
    ),
    Promise(
        2,
        "an old command moves nothing",
        "the browser's link (gets|becomes|is cut) .*",
        "test_a_link_slower_than_the_age_limit_stops_a_robot_despite_a_held_key",
    ),
    Promise(
        3,
        "a page that may lose its inputs releases them",
        "another tab .*|the tab is .*|an alert .*|the page (is frozen|opens .*)",
        "test_an_input_block_is_neutral_within_50_ms_and_a_held_key_does_not_resume",
    ),
    Promise(
        4,
        "one operator at a time",
        "",
        "test_only_one_of_two_pages_drives_and_both_see_the_operator",
    ),
    Promise(
        5,
        "control changes only at standstill",
        "",
        "test_control_changes_from_page_to_page_at_standstill",
    ),
    Promise(
        6,
        "nothing resumes by itself",
        "",
        "test_a_killed_rosbridge_stops_the_robot_and_its_restart_moves_nothing",
    ),
    Promise(
        7,
        "STOP stays active after `kill -9`",
        "the (display|gate) is killed after step n.*",
        "test_after_a_kill_no_motion_resumes_and_an_acknowledged_stop_stays_active",
    ),
    Promise(
        8,
        "STOP acts at once",
        "STOP by the space bar while W is held",
        "test_the_stop_key_stops_the_robot_and_reset_moves_nothing",
    ),
    Promise(
        9,
        "speed limits always hold",
        "",
        "test_no_velocity_exceeds_the_speed_limits_in_force",
    ),
    Promise(
        10,
        "invalid messages move nothing",
        "",
        "test_no_text_of_the_corpus_sent_by_a_page_moves_the_robot",
    ),
    Promise(
        11,
        "no burst after a stall",
        "the robot's link stalls .*",
        "test_a_stalled_robot_link_delivers_few_late_velocities_and_a_zero",
    ),
    Promise(
        12,
        "the command timeout of a base is known",
        "the gate is (killed|stopped.*)",
        "test_a_base_without_a_command_timeout_fails_even_after_an_earlier_pass",
    ),
    Promise(
        13,
        "a start sends nothing or zero",
        "",
        "test_a_machine_marked_as_driven_gets_zeros_on_the_first_link",
    ),
    Promise(
        14,
        "the end of WebMap stops the robot",
        r"the display is (ended.*|killed)",
        "test_a_killed_or_terminated_display_stops_the_robot",
    ),
    Promise(
        15,
        "a slow link slows the robot",
        "",
        "test_a_slow_link_lowers_the_speed_limit_and_the_page_shows_the_reason",
    ),
    Promise(
        16,
        "no driving without odometry",
        "odometry stops",
        "test_a_robot_whose_odometry_ends_is_stopped",
    ),
    Promise(
        17,
        "scan assist stops before obstacles",
        "",
        "test_a_robot_with_scan_assist_never_touches_a_wall",
    ),
    Promise(
        18,
        "under load, releasing the key stops it",
        f"the key is released{BUSY}",
        "test_releasing_the_key_under_load_stops_the_robot_within_100_ms",
    ),
    Promise(
        18,
        "under load, a page that fails stops it",
        f"the browser is stopped{BUSY}",
        "test_the_dead_man_timeout_under_load_stops_the_robot_within_300_ms",
    ),
    Promise(
        18,
        "under load, STOP acts at once",
        f"STOP by the space bar.*{BUSY}",
        "test_stop_under_load_stops_the_robot_within_100_ms",
    ),
    Promise(
        19,
        "the page shows what the robot does",
        "",
        "test_the_page_shows_an_alarm_until_a_disobeying_robot_stops",
    ),
    Promise(
        20,
        "zeros end, then nothing is sent",
        "",
        "test_released_inputs_send_zeros_at_once_for_500_ms_and_then_nothing",
    ),
    Promise(
        21,
        "the driver of a lost robot gets an alarm",
        "",
        "test_the_driver_of_a_robot_whose_agent_is_silent_gets_the_alarm_that_it_may_move",
    ),
)


IN_SHORT = (1, 8, 7, 14, 16)
"""The numbers of the promises that the README has, in its order."""


def nearest(promise: Promise, figures: Sequence[Figure]) -> Figure | None:
    """Return the figure that is nearest to its limit, or None if there is none."""
    own = [f for f in figures if re.fullmatch(promise.figures, f.name)]
    return max(own, key=lambda f: (f.worst / f.promised, f.worst), default=None)


def worst(promise: Promise, figures: Sequence[Figure]) -> str:
    """Return the worst time, the promised time and the fault.

    The fault may differ from the fault of the test in the same row: the tests of S3 and
    S12 do not measure the time of a robot.
    """
    figure = nearest(promise, figures)
    if figure is None:
        return "shown by the test"
    missed = ", **missed**" if figure.worst > figure.promised else ""
    what = figure.name.split(";")[0]  # the promise already names the load
    return (
        f"{figure.worst * 1000:.0f} of {figure.promised * 1000:.0f} ms{missed}: {what}"
    )


def promise_table(figures: Sequence[Figure]) -> str:
    """Return the table in Markdown."""
    lines = ["| | promise | worst measured | shown by |", "|---|---|---|---|"]
    lines += [
        f"| S{p.number} | {p.text} | {worst(p, figures)} | `{p.shown_by}` |"
        for p in PROMISES
    ]
    return "\n".join(lines) + "\n"


def in_short(figures: Sequence[Figure]) -> str:
    """Return the lines of the README in Markdown."""
    promises = [next(p for p in PROMISES if p.number == n) for n in IN_SHORT]
    return "".join(
        f"- S{p.number}: {p.text}. Worst measured: {worst(p, figures)}.\n"
        for p in promises
    )


def kept_figures() -> list[Figure]:
    """Return the figures that the documentation shows."""
    content = json.loads((DOCS / "safety-figures.json").read_text())
    return [Figure(**figure) for figure in content["figures"]]


def write(path: Path, lines: str) -> None:
    """Replace the lines between the two marks of a file."""
    before, rest = path.read_text().split(BEGIN)
    after = rest.split(END)[1]
    path.write_text(f"{before}{BEGIN}{lines}{END}{after}")


def main() -> None:
    """Write the table and the lines of the README."""
    figures = kept_figures()
    write(PAGE, promise_table(figures))
    write(README, in_short(figures))


if __name__ == "__main__":
    main()
