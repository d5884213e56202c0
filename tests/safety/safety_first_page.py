"""The table of promises on the first page: the worst that was measured of each.

``python tests/safety/safety_first_page.py`` writes it anew from
``docs/safety-figures.json``; ``make test-safety`` does that as well.
"""

import json
import re
from collections.abc import Sequence
from typing import NamedTuple

from safety_figures import DOCS, Figure

README = DOCS.parent / "README.md"
BEGIN, END = "<!-- promises -->\n", "<!-- /promises -->\n"


class Promise(NamedTuple):
    """A line of the table."""

    number: int
    words: str
    figures: str
    """What the names of its figures match as a whole; "" where it has none."""
    shown_by: str
    """The test of the promise itself, which need not be one of those that measure."""


BUSY = "; a map of 16 million cells.*"
"""How the names of figures under load go on."""

PROMISES = (
    Promise(
        1,
        "a dead page stops the robot",
        "the (browser|renderer) is (killed|stopped.*)|the page .*"
        "|(half of )?the browser's link (is|stalls) .*",
        "test_a_stopped_browser_stops_the_robot",
    ),
    Promise(
        2,
        "no old command moves it",
        "the browser's link (gets 400 ms|becomes narrow|comes) .*",
        "test_a_link_slower_than_the_age_limit_moves_nothing",
    ),
    Promise(
        3,
        "doubt lets go of keys",
        "another tab .*|the tab is .*|an alert .*|the page is (frozen|left.*)",
        "test_doubt_is_neutral_within_50_ms_and_nothing_resumes",
    ),
    Promise(
        4,
        "one driver at a time",
        "",
        "test_of_two_pages_one_drives_and_both_see_who",
    ),
    Promise(
        5,
        "hand-over only at standstill",
        "",
        "test_a_robot_goes_from_page_to_page_at_standstill",
    ),
    Promise(
        6,
        "nothing resumes by itself",
        "",
        "test_a_rosbridge_that_is_killed_and_restarted_moves_nothing",
    ),
    Promise(
        7,
        "STOP stands through `kill -9`",
        "the (display|gate) is killed after step n.*",
        "test_after_a_kill_nothing_resumes_and_an_acknowledged_stop_stands",
    ),
    Promise(
        8,
        "STOP gets through at once",
        "STOP by the space bar, with W held on",
        "test_stop_on_the_keyboard_stops_the_robot_and_the_reset_moves_nothing",
    ),
    Promise(
        9,
        "speed limits always hold",
        "",
        "test_no_wish_exceeds_the_speeds_in_force",
    ),
    Promise(
        10,
        "garbage moves nothing",
        "",
        "test_nothing_of_the_corpus_moves_the_robot_through_all_processes",
    ),
    Promise(
        11,
        "no burst after a stall",
        "the robot's link stalls .*",
        "test_a_stall_between_gate_and_robot_ends_with_few_late_words_and_a_zero",
    ),
    Promise(
        12,
        "what WebMap cannot stop, is known",
        "the gate is (killed|stopped.*)",
        "test_a_base_without_a_timeout_is_found_although_it_passed_before",
    ),
    Promise(
        13,
        "a start is quiet or zero",
        "",
        "test_a_machine_that_was_driven_gets_zeros_on_first_contact",
    ),
    Promise(
        14,
        "an end stops the robot",
        r"the display is (ended.*|killed)",
        "test_the_end_of_the_display_stops_the_robot",
    ),
    Promise(
        15,
        "slow link, slow robot",
        "",
        "test_a_slow_link_slows_the_robot_down_and_the_page_says_so",
    ),
    Promise(
        16,
        "nobody drives blind",
        "odometry ceases",
        "test_a_robot_that_falls_silent_is_stopped",
    ),
    Promise(
        17,
        "scan assist stops before walls",
        "",
        "test_a_robot_that_is_assisted_never_touches_a_wall",
    ),
    Promise(
        18,
        "under load, letting go stops it",
        f"the key is let go{BUSY}",
        "test_under_load_letting_go_stops_the_robot_as_quickly",
    ),
    Promise(
        18,
        "under load, a dead page stops it",
        f"the browser is stopped{BUSY}",
        "test_under_load_the_dead_man_stops_the_robot_as_quickly",
    ),
    Promise(
        18,
        "under load, STOP gets through",
        f"STOP by the space bar.*{BUSY}",
        "test_under_load_stop_stops_the_robot_as_quickly",
    ),
    Promise(
        19,
        "the screen tells the truth",
        "",
        "test_the_page_says_that_a_robot_does_not_obey_until_it_stands",
    ),
    Promise(
        20,
        "zeros end, then silence",
        "",
        "test_release_is_zero_at_once_then_zeros_for_500_ms_then_silence",
    ),
)


def worst(promise: Promise, figures: Sequence[Figure]) -> str:
    """Return the worst that was measured, of what was promised, and what failed then.

    That is said because it need not be what the test beside it does: those of a page in
    doubt and of a base without a timeout time no robot.
    """
    own = [f for f in figures if re.fullmatch(promise.figures, f.name)]
    if not own:
        return "shown by the test"
    figure = max(own, key=lambda f: (f.worst / f.promised, f.worst))
    missed = ", **missed**" if figure.worst > figure.promised else ""
    what = figure.name.split(";")[0]  # the load is what the promise says
    return (
        f"{figure.worst * 1000:.0f} of {figure.promised * 1000:.0f} ms{missed}: {what}"
    )


def first_page(figures: Sequence[Figure]) -> str:
    """Return the table in Markdown."""
    lines = ["| | promise | worst measured | shown by |", "|---|---|---|---|"]
    lines += [
        f"| S{p.number} | {p.words} | {worst(p, figures)} | `{p.shown_by}` |"
        for p in PROMISES
    ]
    return "\n".join(lines) + "\n"


def kept_figures() -> list[Figure]:
    """Return the figures that the documentation shows."""
    content = json.loads((DOCS / "safety-figures.json").read_text())
    return [Figure(**figure) for figure in content["figures"]]


def main() -> None:
    """Write the table into the first page."""
    before, rest = README.read_text().split(BEGIN)
    after = rest.split(END)[1]
    README.write_text(f"{before}{BEGIN}{first_page(kept_figures())}{END}{after}")


if __name__ == "__main__":
    main()
