"""The tables of figures in the documentation."""

import json
import re

from safety_figures import DOCS, Figure, Soak, note, table
from safety_promises import BEGIN, END, PAGE, kept_figures, promise_table
from safety_run import TRIALS, is_measured

MACHINE = {"processors": 2, "kernel": "Linux 6.1", "python": "3.11.2"}


def test_a_figure_is_one_table_row_in_milliseconds():
    figure = Figure("the page is frozen", "zero", 0.3, 0.0124, 0.0081, 50, "1.0 (a1b)")
    lines = table([figure], [], MACHINE).splitlines()
    assert lines[-3] == (
        "| the page is frozen | zero | 300 ms | 12 ms | 8 ms | 50 | 1.0 (a1b) |"
    )
    assert lines[-1] == "Measured on 2 processors, Linux 6.1, Python 3.11.2."


def test_a_stop_by_the_base_itself_is_shown_as_command_timeout():
    figure = Figure("the gate is killed", "itself", 0.55, 0.51, 0.0, 1)
    assert "| command timeout | 550 ms |" in table([figure], [], MACHINE)


def test_the_figures_document_shows_the_stored_figures():
    content = json.loads((DOCS / "safety-figures.json").read_text())
    figures = [Figure(**figure) for figure in content["figures"]]
    soaks = [Soak(**soak) for soak in content["soak"]]
    assert (DOCS / "safety-figures.md").read_text() == table(
        figures, soaks, content["machine"]
    )


def test_the_table_of_promises_shows_the_stored_figures_and_their_faults():
    table = promise_table(kept_figures())
    assert BEGIN + table + END in PAGE.read_text()
    doubt = r"another tab comes .*|the tab is closed|an alert is shown|the page is .*"
    assert re.search(rf"ms: ({doubt}) \| `test_an_input_block", table)
    gate = r"is killed|is stopped \(SIGSTOP\) for 1\.5 s"
    assert re.search(rf"ms: the gate ({gate}) \| `test_a_base", table)


def test_the_figures_of_the_soak_test_have_their_own_table():
    soaks = [Soak("memory", "%", 10, 1.26, "1.0"), Soak("late", "ms", None, 3.0, "1.0")]
    lines = table([], soaks, MACHINE).splitlines()
    assert lines[-4:-2] == [
        "| memory | 10 % | 1.3 % | 1.0 |",
        "| late |  | 3.0 ms | 1.0 |",
    ]


def test_a_resumed_run_skips_only_complete_and_passing_figures_of_this_version(
    tmp_path, monkeypatch
):
    path = tmp_path / "figures.jsonl"
    monkeypatch.setenv("WEBMAP_SAFETY_FIGURES", str(path))
    monkeypatch.setenv("WEBMAP_SAFETY_RESUME", "1")
    assert not is_measured("the page is frozen"), "there is no figure yet"
    note(Figure("the page is frozen", "zero", 0.3, 0.01, 0.0, TRIALS))
    note(Figure("of another version", "zero", 0.3, 0.01, 0.0, TRIALS, version="0.0"))
    note(Figure("a broken promise", "zero", 0.3, 0.31, 0.0, TRIALS))
    note(Figure("a shorter run", "zero", 0.3, 0.01, 0.0, 3, asked=TRIALS + 1))
    assert is_measured("the page is frozen")
    assert not is_measured("of another version")
    assert not is_measured("a shorter run")
    assert not is_measured("a broken promise")
    assert not is_measured("the tab is closed")
    monkeypatch.delenv("WEBMAP_SAFETY_RESUME")
    assert not is_measured("the page is frozen"), "a new run must measure everything"
