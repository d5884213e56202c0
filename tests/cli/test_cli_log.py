"""``webmap log`` prints the entries of all files, or their CSV."""

import pytest
from click.testing import CliRunner

from webmap.base.errors import ConfigError
from webmap.cli.log import log
from webmap.core.shift_files import FOLDER
from webmap.core.shift_log import Person, RobotName, ShiftLog


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))
    made = ShiftLog()
    made.begin(tmp_path / FOLDER)
    made.note("stop", "pressed STOP", robot=RobotName("r1", "Bob"), person="a program")
    made.note("note", "=1+1", person=Person("Ana", False))
    made.end()

    def run(*arguments):
        return CliRunner().invoke(log, arguments, catch_exceptions=False).output

    return run


def test_the_log_is_printed_by_kind_and_robot(run):
    first, second = run().splitlines()
    assert first.endswith("stop     Bob a program: pressed STOP")
    assert second.endswith("note     Ana*: =1+1")
    assert run("--kind", "note").count("\n") == 1
    assert run("--robot", "Bob", "--since", "7d").count("\n") == 1
    assert "no such entries" in run("--kind", "goal")


def test_the_csv_has_no_formula(run):
    head, stop, note = run("--csv").splitlines()
    assert head.startswith("time,kind,robot,person")
    assert ",stop,Bob,a program," in stop
    assert ",'=1+1," in note


def test_a_wrong_time_is_refused(run):
    with pytest.raises(ConfigError, match="30m, 12h or 7d, got '12x'"):
        run("--since", "12x")
