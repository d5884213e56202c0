"""``webmap user``: each command changes the files, or refuses in one sentence."""

import pytest
from click.testing import CliRunner

from webmap.base.errors import ConfigError
from webmap.cli.user import user
from webmap.server.people import People, UserFile

PASSWORD = "correct horse battery"


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))

    def run(*arguments, typed=f"{PASSWORD}\n"):
        result = CliRunner().invoke(user, arguments, input=typed)
        if result.exception is not None and not isinstance(
            result.exception, SystemExit
        ):
            raise result.exception
        return result.output

    return run


def test_a_user_is_added_changed_and_removed(run, tmp_path):
    file = UserFile(tmp_path)
    assert "no users" in run("list")
    assert "Start WebMap again" in run("add", "ana", "--password-stdin")
    assert "Start" not in run("add", "bob", "--role", "viewer", "--password-stdin")
    assert run("list").split() == ["operator", "ana", "viewer", "bob"]
    before = file.read()["ana"].password
    run("passwd", "ana", "--password-stdin", typed="another password\n")
    assert file.read()["ana"].password != before
    run("role", "ana", "admin")
    assert file.read()["ana"].role == "admin"
    run("remove", "ana")
    assert [*file.read()] == ["bob"]


def test_the_password_is_asked_for_twice_and_not_shown(run, tmp_path):
    output = run("add", "ana", typed=f"{PASSWORD}\n{PASSWORD}\n")
    assert PASSWORD not in output
    assert isinstance(People(tmp_path).sign_in("ana", PASSWORD, ""), str)


def test_sessions_are_listed_and_ended(run, tmp_path):
    run("add", "ana", "--password-stdin")
    people = People(tmp_path)
    first, second = (people.sign_in("ana", PASSWORD, "10.0.0.1") for _ in range(2))
    lines = run("sessions").splitlines()
    assert len(lines) == 2
    assert all(line.endswith("ana  from 10.0.0.1") for line in lines)
    assert "1 session ended" in run("end", lines[0].split()[0])
    people.refresh()
    assert [people.viewer(first), people.viewer(second)].count(None) == 1
    assert "1 session ended" in run("end", "ana")
    people.refresh()
    assert people.viewer(first) is people.viewer(second) is None


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("add", "you", "--password-stdin"), "whose name"),
        (("passwd", "eve", "--password-stdin"), "no user 'eve'; there are: none"),
        (("role", "eve", "viewer"), "no user 'eve'"),
        (("remove", "eve"), "no user 'eve'"),
        (("end", "eve"), "no session 'eve'"),
    ],
)
def test_a_name_that_is_not_known_is_refused(run, arguments, words):
    with pytest.raises(ConfigError, match=words):
        run(*arguments)
