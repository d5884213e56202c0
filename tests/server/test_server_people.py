"""Named users: their file, signing in, what ends a session, and what stays secret."""

import json
import threading
import time
from urllib.parse import urljoin

import httpx
import pytest
from argon2 import PasswordHasher
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from equipment.server_fakes import (
    FakeGate,
    FakeModel,
    FakePage,
    FakeSite,
    key_in,
    running,
)
from equipment.waiting import wait_for
from webmap.base.errors import ConfigError
from webmap.core import operators
from webmap.server import people as module
from webmap.server.access import PROTOCOL, Settings
from webmap.server.app import WebApp
from webmap.server.people import (
    SESSION_S,
    WRONG,
    Denied,
    People,
    SessionFiles,
    UserFile,
)

PASSWORD = "correct horse battery"


@pytest.fixture(autouse=True)
def cheap_hashes(monkeypatch):
    """Hash passwords at a thousandth of the usual cost."""
    cheap = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)
    monkeypatch.setattr(module, "_hasher", lambda: cheap)


@pytest.fixture
def users(tmp_path):
    file = UserFile(tmp_path)
    file.add("ana", "operator", PASSWORD)
    file.add("Björn Öst", "viewer", "look only, please")
    return file


@pytest.fixture
def people(users, tmp_path):
    return People(tmp_path)


def test_users_are_kept_with_a_hash_of_the_password(users):
    assert {name: user.role for name, user in users.read().items()} == {
        "ana": "operator",
        "Björn Öst": "viewer",
    }
    assert PASSWORD not in users.path.read_text()
    assert "argon2id" in users.path.read_text()
    assert users.path.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize(
    ("name", "password", "words"),
    [
        ("ana", PASSWORD, "there is a user 'ana'"),
        ("A.N.A", PASSWORD, "whose name looks like"),
        ("you", PASSWORD, "whose name 'you' is"),
        ("", PASSWORD, "1 to 34 characters"),
        ("two\nlines", PASSWORD, "1 to 34 characters"),
        ("a" * 35, PASSWORD, "1 to 34 characters"),
        ("Ana (desk 4)", PASSWORD, "without parentheses"),
        ("carl", "short", "8 to 256 characters, got 5"),
        ("carl", "x" * 257, "8 to 256 characters, got 257"),
    ],
)
def test_a_user_that_is_not_valid_is_refused(users, name, password, words):
    before = users.path.read_bytes()
    with pytest.raises(ConfigError, match=words):
        users.add(name, "operator", password)
    assert users.path.read_bytes() == before


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[users.ana]\nrole = 'boss'\npassword = 'x'", "boss"),
        ("[users.ana]\nrole = 'viewer'", "password"),
        ("[users.ana]\npassword = 'x'\nrobots = 'bay2'", "robots"),
        ("[users.ana]\npassword = 'x'\nrobots = ['tag:']", "pattern of robots"),
        ("[users.ana]\npassword = 'x'\nmore = []", "more"),
        ('[users."a\\u0000"]\npassword = "x"', "users.toml"),
        ("[users", "users.toml"),
    ],
)
def test_a_mistake_in_the_file_is_an_error_that_names_it(tmp_path, text, words):
    file = UserFile(tmp_path)
    file.path.write_text(text)
    with pytest.raises(ConfigError, match=words) as caught:
        file.read()
    assert "users.toml" in str(caught.value)


def test_the_right_password_gives_a_session_and_a_wrong_one_does_not(people):
    session = people.sign_in("ana", PASSWORD, "10.0.0.1")
    viewer = people.viewer(session)
    assert (viewer.name, viewer.role, viewer.signs_out) == ("ana", "operator", True)
    assert people.sign_in("ana", "wrong", "10.0.0.1") == Denied(WRONG)
    assert people.sign_in("nobody", PASSWORD, "10.0.0.1") == Denied(WRONG)
    assert people.sign_in("", "", "10.0.0.1") == Denied(WRONG)
    assert people.viewer("A" * 22) is None


def test_after_ten_wrong_passwords_the_right_one_waits_too(people):
    for _ in range(10):
        assert people.sign_in("ana", "wrong", "10.0.0.1") == Denied(WRONG)
    refused = people.sign_in("ana", PASSWORD, "10.0.0.1")
    assert 0 < refused.wait <= 60
    # Neither other users of this address, nor ana elsewhere.
    assert isinstance(people.sign_in("Björn Öst", "look only, please", "10.0.0.1"), str)
    assert isinstance(people.sign_in("ana", PASSWORD, "10.0.0.2"), str)


def test_an_address_that_tries_many_names_must_wait(people):
    for number in range(30):
        people.sign_in(f"name {number}", "wrong", "10.0.0.1")
    assert people.sign_in("ana", PASSWORD, "10.0.0.1").wait
    assert isinstance(people.sign_in("ana", PASSWORD, "10.0.0.2"), str)


def test_sessions_last_when_webmap_starts_again(people, tmp_path):
    session = people.sign_in("ana", PASSWORD, "10.0.0.1")
    again = People(tmp_path)
    assert again.viewer(session) == people.viewer(session)
    assert again.secret == people.secret


def test_the_files_do_not_reveal_a_session(people, tmp_path):
    session = people.sign_in("ana", PASSWORD, "10.0.0.1")
    for file in tmp_path.rglob("*"):
        assert session not in str(file)
        if file.is_file():
            assert session.encode() not in file.read_bytes()
            assert file.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize(
    "change", ["remove", "role", "robots", "password", "end", "old"]
)
def test_what_ends_a_session(users, people, tmp_path, change):
    session = people.sign_in("ana", PASSWORD, "10.0.0.1")
    other = people.sign_in("Björn Öst", "look only, please", "10.0.0.1")
    files = SessionFiles(tmp_path)
    if change == "remove":
        users.remove("ana")
    elif change == "role":
        users.change("ana", role="viewer")
    elif change == "robots":
        users.change("ana", robots=["bay2/*"])
    elif change == "password":
        users.change("ana", password="another password")
    elif change == "end":
        [name] = [name for name, each in files.all() if each.user == "ana"]
        files.remove(name)
    else:
        [name] = [name for name, each in files.all() if each.user == "ana"]
        people = People(tmp_path, now=lambda: time.time() + SESSION_S - 10)
        assert people.viewer(session) is not None
        people = People(tmp_path, now=lambda: time.time() + SESSION_S + 10)
        assert people.viewer(session) is None
        return
    people.refresh()
    assert people.viewer(session) is None
    assert people.viewer(other) is not None
    assert [each.user for _, each in files.all()] == ["Björn Öst"]


def test_the_robots_of_a_user_are_kept(users, tmp_path):
    users.change("ana", robots=["bay2/*", "tag:bay 2"])
    users.change("ana", role="admin")
    people = People(tmp_path)
    viewer = people.viewer(people.sign_in("ana", PASSWORD, "10.0.0.1"))
    assert viewer.robots == ("bay2/*", "tag:bay 2")
    users.change("ana", robots=["*"])
    people.refresh()
    assert users.read()["ana"].robots == ("*",)


def test_a_user_of_an_earlier_version_has_every_robot_and_stays_signed_in(
    users, people, tmp_path
):
    session = people.sign_in("ana", PASSWORD, "10.0.0.1")
    text = users.path.read_text()
    users.path.write_text(text.replace('robots = ["*"]\n', ""))
    people.refresh()
    assert people.viewer(session).robots == ("*",)


def test_a_mistake_in_the_file_leaves_the_users_as_they_were(users, people):
    session = people.sign_in("ana", PASSWORD, "10.0.0.1")
    users.path.write_text("[users")
    with pytest.raises(ConfigError):
        people.refresh()
    people.refresh()  # the mistake is reported once
    assert people.viewer(session) is not None


def test_a_damaged_session_is_no_session(people, tmp_path):
    folder = tmp_path / "sessions"
    folder.mkdir(exist_ok=True)
    (folder / "0123456789abcdef.json").write_text("{")
    (folder / "fedcba9876543210.json").write_text(json.dumps({"user": "ana"}))
    people.refresh()
    assert list(SessionFiles(tmp_path).all()) == []


def test_the_oldest_session_ends_for_a_new_one(people, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "MOST_SESSIONS", 3)
    sessions = [people.sign_in("ana", PASSWORD, "10.0.0.1") for _ in range(5)]
    people.refresh()
    assert [people.viewer(each) is not None for each in sessions] == [
        False,
        False,
        True,
        True,
        True,
    ]


def test_a_folder_that_cannot_be_read_ends_no_session(people, monkeypatch):
    session = people.sign_in("ana", PASSWORD, "10.0.0.1")

    def fail(folder):
        raise OSError(5, "Input/output error")

    with monkeypatch.context() as patch:
        patch.setattr(module.Path, "iterdir", fail)
        with pytest.raises(OSError, match="Input/output"):
            people.refresh()
    assert people.viewer(session) is not None


def test_a_full_disk_refuses_a_sign_in_in_a_sentence(people, monkeypatch, caplog):
    def fail(file, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module, "write_file", fail)
    refused = people.sign_in("ana", PASSWORD, "10.0.0.1")
    assert "disk may be full" in refused.text
    assert "No space left" in caplog.text


def test_a_slow_disk_keeps_nobody_waiting_who_has_signed_in(people, monkeypatch):
    session = people.sign_in("ana", PASSWORD, "10.0.0.1")
    writing, go_on = threading.Event(), threading.Event()

    def wait(file, data):
        writing.set()
        assert go_on.wait(20)

    monkeypatch.setattr(module, "write_file", wait)
    other = threading.Thread(target=people.sign_in, args=("ana", PASSWORD, "10.0.0.2"))
    other.start()
    answers = []
    asking = threading.Thread(target=lambda: answers.append(people.viewer(session)))
    try:
        assert writing.wait(20)
        asking.start()
        asking.join(20)
        assert answers[0].name == "ana"
    finally:
        go_on.set()
        other.join(20)


# Over HTTP.


@pytest.fixture
def gate():
    return FakeGate()


@pytest.fixture
def served(people, gate):
    settings = Settings(token=people.secret, people=people)
    app = WebApp(FakeSite(FakePage("/")), FakeModel(), gate, settings)
    with running(app) as server:
        yield server


@pytest.fixture
def browser(served):
    with httpx.Client(
        base_url=served.origin,
        follow_redirects=True,
        headers={"accept": "text/html", "origin": served.origin},
    ) as client:
        yield client


def type_in(browser, name="ana", password=PASSWORD, path="/"):
    """Send the form of the page that asks for the name."""
    fields = {"name": name, "password": password, "path": path}
    return browser.post("/_webmap/sign-in", data=fields)


def drive(served, browser, key):
    """Return the page's socket to the gate."""
    cookies = "; ".join(f"{name}={value}" for name, value in browser.cookies.items())
    return connect(
        served.socket_url("drive?id=page"),
        origin=served.origin,
        subprotocols=[PROTOCOL, key],
        additional_headers={"cookie": cookies},
    )


def test_a_person_signs_in_with_name_and_password(served, browser, gate, caplog):
    asked = browser.get("/")
    assert asked.status_code == 401
    assert 'name="password"' in asked.text
    assert asked.headers["referrer-policy"] == "same-origin"
    page = type_in(browser)
    assert page.status_code == 200
    with drive(served, browser, key_in(page.text)):
        wait_for(lambda: gate.connections)
    [connection] = gate.connections
    assert (connection.name, connection.role) == ("ana", "operator")
    assert connection.identity.verified
    assert PASSWORD not in caplog.text


def test_the_gate_learns_which_robots_a_person_may_drive(
    served, browser, gate, users, people, monkeypatch
):
    users.change("ana", robots=["bay2/*", "tag:lift"])
    people.refresh()
    names = {"r1": ("bay2/bob", ()), "r2": ("bay1/eve", ()), "r3": ("x", ("lift",))}
    monkeypatch.setattr(operators, "named_robots", names)
    with drive(served, browser, key_in(type_in(browser).text)):
        wait_for(lambda: gate.connections)
    may_drive = gate.connections[0].may_drive
    assert [may_drive(id) for id in ("r1", "r2", "r3", "r4")] == [True, False] * 2
    assert gate.connections[0].role == "operator"


def test_neither_the_secret_nor_a_wrong_password_signs_in(browser, people, caplog):
    assert browser.get("/", params={"token": people.secret}).status_code == 401
    refused = type_in(browser, password="a wrong password")
    assert refused.status_code == 401
    assert WRONG in refused.text
    assert "a wrong password" not in refused.text + caplog.text
    assert not browser.cookies


def test_a_page_of_another_origin_cannot_sign_in(browser):
    browser.headers["origin"] = "http://evil.example"
    assert type_in(browser).status_code == 403
    del browser.headers["origin"]
    assert type_in(browser).status_code == 403


@pytest.mark.parametrize("path", ["//evil.example", "/\\evil.example", "https://evil"])
def test_signing_in_leads_to_a_page_of_this_server_alone(browser, path):
    browser.follow_redirects = False
    answer = type_in(browser, path=path)
    assert answer.status_code == 303
    location = urljoin(str(answer.url), answer.headers["location"])
    assert location.startswith(str(browser.base_url))


def test_a_form_that_is_too_long_is_refused(browser):
    assert type_in(browser, name="x" * 20_000).status_code == 401
    assert type_in(browser, name="x" * 8_000).status_code == 401


def test_the_form_repeats_a_path_as_text(browser):
    asked = browser.get('/"><script>alert(1)</script>')
    assert asked.status_code == 401
    assert "<script" not in asked.text


@pytest.mark.parametrize(
    "change", ["remove", "role", "robots", "password", "end", "sign out"]
)
def test_a_session_that_ends_closes_its_sockets_within_a_second(
    served, browser, gate, users, tmp_path, change
):
    key = key_in(type_in(browser).text)
    with drive(served, browser, key) as socket:
        wait_for(lambda: gate.connections)
        begin = time.monotonic()
        if change == "remove":
            users.remove("ana")
        elif change == "role":
            users.change("ana", role="admin")
        elif change == "robots":
            users.change("ana", robots=["bay2/*"])
        elif change == "password":
            users.change("ana", password="another password")
        elif change == "end":
            files = SessionFiles(tmp_path)
            for name in files.names():
                files.remove(name)
        else:
            headers = {"webmap-key": key}
            answer = browser.post("/_webmap/sign-out", headers=headers)
            assert answer.status_code == 204
        with pytest.raises(ConnectionClosed, match="not signed in any more"):
            socket.recv(timeout=20)
        took = time.monotonic() - begin
    wait_for(lambda: gate.connections[0].times_closed)
    assert browser.get("/").status_code == 401
    assert browser.post("/_webmap/key", headers={"webmap-key": key}).status_code == 401
    assert took < 10  # the promise of a second is measured among the tests of time


@pytest.mark.serial
def test_whoever_is_removed_is_disconnected_within_a_second(
    served, browser, gate, users
):
    key = key_in(type_in(browser).text)
    with drive(served, browser, key) as socket:
        wait_for(lambda: gate.connections)
        begin = time.monotonic()
        users.remove("ana")
        with pytest.raises(ConnectionClosed):
            socket.recv(timeout=20)
        assert time.monotonic() - begin < 1.0


def test_without_the_package_argon2_the_error_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.undo()
    monkeypatch.setitem(__import__("sys").modules, "argon2", None)
    with pytest.raises(ConfigError, match=r"pip install 'webmap\[auth\]'"):
        UserFile(tmp_path).add("ana", "operator", PASSWORD)
