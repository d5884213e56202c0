"""Addresses of routers and agents, users, and the access rules of the router."""

import socket
import tempfile
from pathlib import Path

import pytest

from webmap.agents import address, router
from webmap.agents.router import (
    access_rules,
    open_router,
    read_users,
    router_settings,
)
from webmap.base.errors import ConfigError
from webmap.base.tls import TlsFiles
from webmap.ros.names import is_agent_url, normalise_url

USERS = """
[users.bay3]
password = "one"
agent = "bay3"

[users.west]
password = "two"
drives = ["bay3"]
"""


@pytest.fixture
def users(tmp_path):
    file = tmp_path / "users.toml"
    file.write_text(USERS)
    return file


@pytest.mark.parametrize(
    ("text", "locator"),
    [
        ("zenoh://hall", "tcp/hall:7447"),
        ("zenohs://hall:80/bay3", "tls/hall:80"),
        ("tls/hall:7447", "tls/hall:7447"),
        ("tcp/hall", "tcp/hall:7447"),
        ("zenoh://[::1]:9", "tcp/[::1]:9"),
        ("tcp/[::1]", "tcp/[::1]:7447"),
    ],
)
def test_the_address_of_a_router(text, locator):
    assert address.locator(text) == locator


@pytest.mark.parametrize("text", ["", "hall", "ws://hall", "udp/hall:1", "zenoh://"])
def test_what_is_no_address_of_a_router_is_refused(text):
    with pytest.raises(ConfigError, match="expected one such as zenoh://host:7447"):
        address.locator(text)


def test_the_address_of_an_agent():
    assert is_agent_url("ZENOH://hall")
    assert not is_agent_url("ws://hall")
    assert address.agent_in("zenoh://hall:7447/bay3") == "bay3"
    assert address.agent_in("zenoh://hall:7447") is None
    assert normalise_url("zenoh://Hall:7447/bay3/") == "zenoh://hall/bay3"
    with pytest.raises(ConfigError, match="got the agent"):
        address.agent_in("zenoh://hall/a/b")


def test_the_sender_is_named_by_the_key():
    key = address.data_in("bay3", "west", "4f", "1")
    assert address.sender_of(key) == ("west", "4f", "1")
    for key_of in (address.gate_in, address.camera_in):
        key = key_of("bay3", "west", "4f")
        assert address.sender_of(key).display == "west.4f"


def test_an_agent_sends_as_itself_and_a_display_as_its_user(users):
    rules = {rule["id"]: rule for rule in access_rules(read_users(users))["rules"]}
    assert rules["bay3-sends"]["key_exprs"] == [
        "webmap/bay3/here",
        "webmap/bay3/gate/out/*",
        "webmap/bay3/data/out/**",
        "webmap/bay3/topics/**",
        "webmap/bay3/pictures/out/**",
        "webmap/bay3/pictures/of/*",
    ]
    assert rules["west-sends"]["key_exprs"] == [
        "webmap/bay3/gate/in/west/*/*",
        "webmap/bay3/data/in/west/*/*",
        "webmap/bay3/pictures/in/west/*",
    ]
    assert access_rules(read_users(users))["default_permission"] == "deny"


def test_the_passwords_are_in_a_file_of_this_user_alone(users):
    settings = router_settings("tcp/127.0.0.1:1", read_users(users))
    file = Path(settings["transport"]["auth"]["usrpwd"]["dictionary_file"])
    assert file.read_text() == "bay3:one\nwest:two\n"
    assert file.stat().st_mode & 0o077 == 0
    file.unlink()


def test_the_passwords_are_deleted_when_zenoh_has_read_them(
    users, tmp_path, monkeypatch
):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    session, place = open_router("tcp/127.0.0.1:0", read_users(users))
    assert not list(tmp_path.glob("webmap-router-*"))
    with pytest.raises(ConfigError, match=f"cannot listen on {place}"):
        open_router(place, read_users(users))
    assert not list(tmp_path.glob("webmap-router-*"))
    session.close()


def test_a_router_takes_another_free_port_if_its_own_was_taken_meanwhile(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as other:
        taken = f"tcp/127.0.0.1:{other.getsockname()[1]}"
        places = [taken, router.free_port("tcp/127.0.0.1:0")]
        monkeypatch.setattr(router, "free_port", lambda _listen: places.pop(0))
        session, place = open_router("tcp/127.0.0.1:0", None)
        session.close()
        assert place != taken
        monkeypatch.setattr(router, "free_port", lambda _listen: taken)
        with pytest.raises(ConfigError, match="cannot listen on"):
            open_router("tcp/127.0.0.1:0", None)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("users = 3", "users"),
        ('[users.a]\npassword = "x"', 'needs either "agent"'),
        ('[users.a]\npassword = ""\nagent = "a"', "no password"),
        ('[users."a b"]\npassword = "x"\nagent = "a"', "got the user 'a b'"),
        ('[users.a]\npassword = "x"\nagent = "a/b"', "got the agent 'a/b'"),
        ('[users.a]\npassword = "x"\nagent = "a"\nrole = 1', "role"),
    ],
)
def test_mistakes_in_the_file_of_users_are_named(tmp_path, text, words):
    file = tmp_path / "users.toml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=words):
        read_users(file)


@pytest.mark.parametrize(
    ("listen", "with_users", "words"),
    [
        ("tcp/0.0.0.0:1", False, "can be reached from other computers"),
        ("tcp/0.0.0.0:1", True, "can be reached from other computers"),
        ("tls/127.0.0.1:1", False, "TLS needs --tls, or --tls-cert and --tls-key"),
    ],
)
def test_a_router_is_closed_by_default(users, listen, with_users, words):
    known = read_users(users) if with_users else None
    with pytest.raises(ConfigError, match=words):
        router_settings(listen, known)


def test_a_router_with_a_certificate_listens_with_tls():
    files = TlsFiles(Path("router.pem"), Path("router.key"))
    with pytest.raises(ConfigError, match="expected tls/HOST:PORT"):
        router_settings("tcp/127.0.0.1:1", None, files=files)


def test_port_0_becomes_a_free_port():
    settings = router_settings("tcp/127.0.0.1:0", None)
    (place,) = settings["listen"]["endpoints"]
    assert int(place.rpartition(":")[2]) > 0
