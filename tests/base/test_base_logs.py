"""The lines of a log, whichever program configured it."""

import ast
import io
import logging
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import webmap
from webmap.base.logs import (
    BURST,
    LOGGERS,
    MOST_LINES,
    MOST_SOURCES,
    PAUSE,
    Budgets,
)
from webmap.base.text import LONGEST, lines_of, one_line

SOURCE = Path(webmap.__file__).parent

EVIL = "bad\n2026-01-01 ERROR webmap.gate: forged\r\x1b[2J\x9b31m\u202e\u2028\ud800\x07"


@pytest.fixture
def written():
    """The lines of a handler that does not belong to WebMap."""
    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(logging.Formatter("%(levelname)s %(name)s: %(message)s"))
    root = logging.getLogger()
    root.addHandler(handler)
    yield stream
    root.removeHandler(handler)


@pytest.mark.parametrize("name", LOGGERS)
def test_outside_text_is_logged_as_one_escaped_line_by_any_handler(written, name):
    logging.getLogger(name).warning("%s says: %s", "bridge", EVIL)
    assert written.getvalue() == (
        f"WARNING {name}: bridge says: bad\\n2026-01-01 ERROR webmap.gate: forged"
        "\\r\\x1b[2J\\x9b31m\\u202e\\u2028\\ud800\\x07\n"
    )


def test_a_very_long_log_text_is_cut(written):
    logging.getLogger("webmap.ros").warning("%s: %s", "bridge", "x" * (1 << 24))
    assert len(written.getvalue()) < LONGEST + 100
    assert written.getvalue().endswith("...\n")


def test_the_text_of_an_exception_cannot_forge_a_log_line(written):
    try:
        raise ValueError(EVIL + "\nINFO webmap: " + "y" * 10_000)
    except ValueError:
        logging.getLogger("webmap.gate").exception("it failed: %s", EVIL)
    lines = written.getvalue().split("\n")
    assert "\x1b" not in written.getvalue()
    assert lines[1] == "  Traceback (most recent call last):"
    assert lines.pop() == ""
    assert [line for line in lines[1:] if not line.startswith("  ")] == []
    assert max(map(len, lines)) < LONGEST + 100


def test_a_traceback_of_many_lines_is_cut(written):
    try:
        raise ValueError("\n" * 10_000)
    except ValueError:
        logging.getLogger("webmap.ros").exception("a frame was lost")
    lines = written.getvalue().splitlines()
    assert len(lines) == MOST_LINES + 2
    assert "lines are left out" in lines[1 + MOST_LINES // 2]


def test_the_log_limit_of_one_bridge_does_not_affect_another_bridge(written):
    log = logging.getLogger("webmap.ros")
    for name in (*["hostile"] * 1000, "good"):
        log.warning("%s says: %s", name, "hello")
    *hostile, good = written.getvalue().splitlines()
    assert len(hostile) == BURST
    assert hostile[-1].endswith("(similar lines are left out, except one every 5 s)")
    assert good == "WARNING webmap.ros: good says: hello"


def test_the_source_of_a_log_record_may_be_given_in_extra(written):
    log = logging.getLogger("webmap.ros")
    for name in (*["hostile"] * 1000, "good"):
        log.warning("%s", f"{name} is away", extra={"source": name})
    assert len(written.getvalue().splitlines()) == BURST + 1


def test_a_record_that_cannot_be_formatted_is_logged_without_an_error(written):
    class Wicked:
        def __str__(self):
            raise RuntimeError("no words")

    logging.getLogger("webmap.ros").warning("%s: %s", "bridge", Wicked())
    logging.getLogger("webmap.ros").warning("%d", "bridge")
    assert written.getvalue() == (
        "WARNING webmap.ros: %s: %s\nWARNING webmap.ros: %d\n"
    )


def test_a_limited_source_logs_one_line_per_pause_with_the_omitted_count():
    now = [100.0]
    budgets = Budgets(lambda: now[0])
    notes = [budgets.note(("here",), "a") for _ in range(BURST + 7)]
    assert notes[: BURST - 1] == [""] * (BURST - 1)
    assert notes[BURST - 1].startswith(" (similar lines are left out")
    assert notes[BURST:] == [None] * 7
    now[0] += PAUSE
    assert budgets.note(("here",), "a").startswith(" (7 more were left out) (similar")
    assert budgets.note(("here",), "a") is None
    now[0] += BURST * PAUSE
    assert budgets.note(("here",), "a") == " (1 more were left out)"
    assert budgets.note(("here",), "a") == ""


def test_the_number_of_log_sources_is_limited_and_old_sources_are_forgotten():
    now = [100.0]
    budgets = Budgets(lambda: now[0])
    for number in range(MOST_SOURCES + 500):
        budgets.note(("here",), str(number))
    assert len(budgets._sources) == MOST_SOURCES + 1
    assert budgets.note(("here",), "another") is None
    now[0] += BURST * PAUSE
    assert budgets.note(("here",), "another") == ""
    assert len(budgets._sources) == 1


def test_every_logger_of_the_package_is_guarded():
    named = {
        ast.unparse(node.args[0])
        for file in SOURCE.rglob("*.py")
        if file != SOURCE / "base" / "logs.py"
        and "getLogger" in (text := file.read_text())
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("getLogger")
    }
    own = {name for name in named if name.startswith("'webmap")}
    assert own == {repr(name) for name in LOGGERS}


def test_a_webmap_process_also_escapes_the_logs_of_other_libraries():
    program = (
        "import logging, webmap.base.logs\n"
        "webmap.base.logs.set_up_logging(format='%(message)s')\n"
        "logging.getLogger('somebody').error('a\\n\\x1b[2J')\n"
        "logging.getLogger('webmap.ros').error('b\\n')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stderr == "a\\n\\x1b[2J\nb\\n\n"


@given(st.text(), st.integers(10, 60))
def test_one_line_is_printable_limited_and_idempotent(text, longest):
    shown = one_line(text, longest)
    assert shown.isprintable()
    assert len(shown) <= longest
    assert one_line(shown, longest) == shown
    if text.isprintable() and len(text) <= longest:
        assert shown == text


def test_lines_of_keeps_line_breaks_and_escapes_other_control_characters():
    assert lines_of("a\n\x1bb\r") == "a\n\\x1bb\\r"
