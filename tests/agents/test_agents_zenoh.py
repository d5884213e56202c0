"""Peers and a real router: users, rules, TLS and lost connections."""

import socket
import threading
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from equipment.waiting import wait_for
from webmap.agents import address
from webmap.agents.gate_messages import MOST_SAMPLE
from webmap.agents.peer import Peer
from webmap.agents.router import free_port, open_router, read_users
from webmap.agents.router_access import RouterUser
from webmap.base.errors import WireError
from webmap.base.tls import TlsFiles, tls_files
from webmap.base.zenoh_sessions import why_not_reached

pytestmark = pytest.mark.slow

pytest.importorskip("zenoh")

TLS = Path(__file__).with_name("tls")

USERS = """
[users.bay3]
password = "one"
agent = "bay3"

[users.bay4]
password = "four"
agent = "bay4"

[users.west]
password = "two"
drives = ["bay3"]
"""


@contextmanager
def router(listen="tcp/127.0.0.1:0", users=None, **options):
    """Run a router in this process; yield its locator."""
    session, place = open_router(listen, users, **options)
    try:
        yield place
    finally:
        session.close()


@contextmanager
def peers(place, *users):
    """Connect one peer for each user."""
    with ExitStack() as closing:
        made = [Peer(place, user) for user in users]
        for peer in made:
            closing.callback(peer.close)
            peer.start()
        wait_for(lambda: all(peer.connected for peer in made))
        yield made


@pytest.fixture
def users(tmp_path):
    file = tmp_path / "users.toml"
    file.write_text(USERS)
    return read_users(file)


@pytest.mark.parametrize("by", ["router", "agent"])
def test_a_large_sample_of_a_display_is_dropped_unread(by):
    got = []
    key = address.gate_in("bay3", "west", "1") if by == "router" else "webmap/other"
    with router() as place, peers(place, RouterUser(), RouterUser()) as (one, other):
        most = {} if by == "router" else {"most": MOST_SAMPLE}
        other.listen(key, lambda _, data: got.append(len(data)), gate=True, **most)
        wait_for(lambda: one.put_gate(key, b"x") or got)
        for size in (1 << 20, MOST_SAMPLE + 1, MOST_SAMPLE):
            one.put_gate(key, bytes(size))
        wait_for(lambda: max(got) > 1)
        assert max(got) == MOST_SAMPLE


def test_messages_arrive_with_their_keys_and_questions_are_answered():
    got = []
    with router() as place, peers(place, RouterUser(), RouterUser()) as (one, other):
        other.listen("webmap/*/here", lambda key, data: got.append((key, data)))
        other.listen("webmap/a/gate/out", lambda _, data: got.append(data), gate=True)
        one.answer("webmap/a/about", lambda: b"robots")
        wait_for(lambda: other.ask("webmap/a/about") == b"robots")
        one.put_data("webmap/a/here", b"x")
        one.put_gate("webmap/a/gate/out", b"tick")
        wait_for(lambda: len(got) == 3)
    expected = [("webmap/a/here", b"x"), b"tick", b"tick"]
    assert sorted(map(str, got)) == sorted(map(str, expected))


def send_until_it_arrives(peer, got, times, only=None):
    """Send samples until one arrives; a busy machine may drop one.

    Args:
        peer: The sender.
        got: What the receiver got.
        times: How often a sample must arrive.
        only: The connection to send it over.

    """
    for number in range(100):
        data = f"{times} {only} {number}".encode()
        peer.put_gate("k", data, only=only)
        deadline = time.monotonic() + 0.2
        while time.monotonic() < deadline:
            if got.count(data) >= times:
                return
            time.sleep(0.005)
    raise AssertionError(f"no sample arrived {times} times")


def test_a_sample_of_the_gate_is_sent_over_one_connection_alone():
    got = []
    with router() as place, peers(place, RouterUser(), RouterUser()) as (one, other):
        other.listen("k", lambda key, data: got.append(data), gate=True)
        send_until_it_arrives(one, got, 2)
        for number in range(4):
            send_until_it_arrives(one, got, 1, only=number)
        send_until_it_arrives(one, got, 2)  # after all others on both connections
    single = [data for data in got if data.startswith(b"1 ")]
    assert len(single) == len(set(single))


def test_an_ended_listener_gets_nothing():
    got = []
    with router() as place, peers(place, RouterUser(), RouterUser()) as (one, other):
        number = other.listen("k", lambda key, data: got.append(data))
        other.listen("k", lambda key, data: got.append(b"second " + data))
        wait_for(lambda: (one.put_data("k", b"1"), time.sleep(0.05), got)[2])
        other.unlisten(number)
        got.clear()
        one.put_data("k", b"2")
        wait_for(lambda: got)
        time.sleep(0.1)
    assert got == [b"second 2"]


def test_a_peer_without_a_router_says_so_and_connects_when_there_is_one():
    place = free_port("tcp/127.0.0.1:0")
    peer = Peer(place, RouterUser())
    try:
        peer.start()
        wait_for(lambda: "cannot reach the router" in (peer.trouble or ""))
        assert peer.ask("k") is None
        peer.put_data("k", b"lost")
        peer.put_gate("k", b"lost")
        with router(place):
            wait_for(lambda: peer.connected)
        wait_for(lambda: peer.trouble == f"no connection to the router at {place}")
        with router(place):
            wait_for(lambda: peer.connected)
    finally:
        peer.close()


def test_a_sample_for_a_session_that_closes_is_dropped():
    with router() as place, peers(place, RouterUser()) as (peer,):
        for session in peer._gate:
            session.close()
        peer.put_gate("k", b"late")


def test_a_user_with_a_wrong_password_is_not_let_in(users):
    with router(users=users) as place:
        peer = Peer(place, RouterUser("west", "wrong"))
        try:
            peer.start()
            wait_for(lambda: "does not let the user west in" in (peer.trouble or ""))
            time.sleep(0.5)
            assert not peer.connected
        finally:
            peer.close()


def test_a_display_reaches_the_agents_that_its_user_may_drive(users):
    got = []
    west, bay3, bay4 = (
        RouterUser("west", "two"),
        RouterUser("bay3", "one"),
        RouterUser("bay4", "four"),
    )
    with (
        router(users=users) as place,
        peers(place, west, bay3, bay4) as (display, one, other),
    ):
        for peer, agent in ((one, "bay3"), (other, "bay4")):
            key = address.gate_in(agent, "*", "*")
            peer.listen(
                key,
                lambda key, data, agent=agent: got.append((agent, data)),
                gate=True,
            )
            peer.answer(address.about(agent), agent.encode)
        wait_for(lambda: display.ask(address.about("bay3")) == b"bay3")
        assert display.ask(address.about("bay4")) is None
        with pytest.raises(WireError, match="got 4 bytes, expected 3 at most"):
            display.ask(address.about("bay3"), most=3)
        mine = address.gate_in("bay3", "west", west.instance)
        wait_for(lambda: (display.put_gate(mine, b"mine"), time.sleep(0.05), got)[2])
        for key in (
            address.gate_in("bay4", "west", west.instance),
            address.gate_in("bay3", "east", west.instance),
            address.gate_in("bay3", "bay3", "x"),
        ):
            display.put_gate(key, b"not mine")
        time.sleep(0.5)
    assert {each for each in got} == {("bay3", b"mine")}


def test_a_display_and_another_agent_cannot_speak_for_an_agent(users):
    got = []
    west, bay3, bay4 = (
        RouterUser("west", "two"),
        RouterUser("bay3", "one"),
        RouterUser("bay4", "four"),
    )
    with (
        router(users=users) as place,
        peers(place, RouterUser("west", "two"), west, bay3, bay4) as (
            listener,
            display,
            one,
            other,
        ),
    ):
        listener.listen(
            address.gate_out("bay3"), lambda _, data: got.append(data), gate=True
        )
        key = address.gate_out("bay3")
        wait_for(lambda: (one.put_gate(key, b"tick"), time.sleep(0.05), got)[2])
        other.put_gate(key, b"false")
        display.put_gate(key, b"false")
        time.sleep(0.5)
    assert set(got) == {b"tick"}


def test_a_display_finds_the_agents_that_it_reaches_without_their_names(users):
    found = []
    west, bay3, bay4 = (
        RouterUser("west", "two"),
        RouterUser("bay3", "one"),
        RouterUser("bay4", "four"),
    )
    with (
        router(users=users) as place,
        peers(place, west, bay3, bay4) as (display, one, other),
    ):
        display.listen(address.beacon(address.EVERY), lambda key, _: found.append(key))
        wait_for(
            lambda: (
                other.put_data(address.beacon("bay4"), b"here"),
                one.put_data(address.beacon("bay3"), b"here"),
                time.sleep(0.05),
                len(found) > 5,
            )[3]
        )
    assert set(found) == {"webmap/bay3/here"}


def test_peers_reach_a_router_over_tls():
    with (
        router(
            "tls/127.0.0.1:0",
            files=TlsFiles(TLS / "router.pem", TLS / "router.key"),
        ) as place,
        peers(place, RouterUser(ca=str(TLS / "ca.pem"))) as (peer,),
    ):
        assert peer.connected


def test_peers_trust_a_router_by_the_authority_that_webmap_made(users, tmp_path):
    find = tls_files("0.0.0.0", tmp_path, True, "", "")
    files = find()
    with (
        router("tls/127.0.0.1:0", users, files=files) as place,
        peers(place, RouterUser("west", "two", str(files.authority))) as (peer,),
    ):
        assert peer.connected


@pytest.mark.parametrize(
    ("name", "words"),
    [("expired", "certificate has expired"), ("router", "local issuer certificate")],
)
def test_a_router_with_a_wrong_certificate_is_refused(name, words):
    with router(
        "tls/127.0.0.1:0",
        files=TlsFiles(TLS / f"{name}.pem", TLS / f"{name}.key"),
    ) as place:
        peer = Peer(
            place, RouterUser(ca=str(TLS / "ca.pem") if name == "expired" else "")
        )
        try:
            peer.start()
            wait_for(lambda: "its certificate is not valid" in (peer.trouble or ""))
            assert words in peer.trouble
            assert not peer.connected
        finally:
            peer.close()


def test_of_messages_that_wait_for_a_slow_link_the_newest_are_kept():
    peer = Peer("tcp/127.0.0.1:1", RouterUser())  # it is not started
    peer.trouble = None
    for number in range(2000):
        peer.put_data("small", b"%d" % number)
        peer.put_data("large", bytes(5000) + b"%d" % number)
        peer.put_data("answers", b"%d" % number, all=True)
        peer.put_data("changes", bytes(1000), all=True, size=10_000)
    waiting = peer._waiting
    assert list(waiting["small"]) == [b"%d" % n for n in range(1990, 2000)]
    assert [each[5000:] for each in waiting["large"]] == [b"1999"]
    assert len(waiting["answers"]) == 1000
    assert len(waiting["changes"]) == 11


def test_what_is_larger_than_expected_is_dropped_before_it_fills_the_memory():
    got = []
    with router() as place, peers(place, RouterUser()) as (sender,):
        small = Peer(place, RouterUser(), most=1 << 20)
        try:
            small.start()
            wait_for(lambda: small.connected)
            small.listen("k", lambda key, data: got.append(len(data)), most=1000)
            small.listen("l", lambda key, data: got.append(len(data)))
            wait_for(lambda: (sender.put_data("l", b"1"), time.sleep(0.05), got)[2])
            sender.put_data("k", bytes(1001))
            sender.put_data("l", bytes(8 << 20))
            sender.put_data("k", bytes(999))
            wait_for(lambda: 999 in got)
            assert small.connected
        finally:
            small.close()
    assert set(got) == {1, 999}


def test_what_waits_for_a_slow_link_does_not_fill_the_memory():
    peer = Peer("tcp/127.0.0.1:1", RouterUser())
    peer.trouble = None
    for _ in range(20):
        peer.put_data("k", bytes(2 << 20), all=True)
    assert sum(map(len, peer._waiting["k"])) <= 12 << 20


def test_a_self_signed_certificate_that_zenoh_refuses_is_no_wrong_password(users):
    files = TlsFiles(TLS / "self-signed.pem", TLS / "self-signed.key")
    with router("tls/127.0.0.1:0", users, files=files) as place:
        peer = Peer(place, RouterUser("west", "two", str(files.certificate)))
        try:
            peer.start()
            wait_for(lambda: "cannot reach the router" in (peer.trouble or ""))
            assert "its certificate is not valid: it is that of an" in peer.trouble
            assert "password" not in peer.trouble
        finally:
            peer.close()


@pytest.mark.slow
def test_a_closed_peer_leaves_no_thread_inside_zenoh():
    with socket.create_server(("127.0.0.1", 0)) as silent:
        peer = Peer(f"tcp/127.0.0.1:{silent.getsockname()[1]}", RouterUser())
        peer.start()
        time.sleep(0.3)
        peer.close()
    assert not any(thread.is_alive() for thread in peer._threads)


def test_a_peer_is_closed_when_the_functions_that_it_calls_have_ended():
    called = threading.Event()

    def take(*_):
        called.set()
        time.sleep(0.5)

    before = set(threading.enumerate())
    with router() as place:
        peer = Peer(place, RouterUser())
        peer.start()
        wait_for(lambda: peer.connected)
        peer.unlisten(peer.listen("webmap/b/here", take))
        peer.listen("webmap/a/here", take)
        peer.answer("webmap/a/about", lambda: b"robots")
        peer.put_data("webmap/a/here", b"x")
        assert called.wait(10)
        peer.close()
        assert set(threading.enumerate()) <= before


def test_an_agent_hears_only_from_the_router_what_it_may_send(users):
    heard = []
    with (
        router(users=users) as place,
        peers(place, RouterUser("bay3", "one"), RouterUser("west", "two")) as both,
    ):
        for peer in both:
            name = peer.user.name
            peer.listen(
                "webmap/bay3/here", lambda *_, name=name: heard.append(name), back=True
            )
        both[1].put_data("webmap/bay3/here", b"x")
        time.sleep(0.5)
        assert heard == []
        wait_for(
            lambda: (
                both[0].put_data("webmap/bay3/here", b"x"),
                time.sleep(0.05),
                {*heard} == {"bay3", "west"},
            )[2]
        )


def test_a_host_name_that_cannot_be_sent_is_a_reason():
    assert "label empty or too long" in why_not_reached("tcp/robot..x:7447")
