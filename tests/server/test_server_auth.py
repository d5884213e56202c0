import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.errors import ConfigError
from webmap.server.auth import Attempts, Codes, Token, new_token

SECRET = "s" * 43


def test_each_new_token_is_different_and_valid():
    first, second = new_token(), new_token()
    assert first != second
    assert Token(first).matches(first)
    assert not Token(first).matches(second)


@pytest.mark.parametrize("secret", ["", "short", "s" * 42, "s" * 42 + "/", "s" * 257])
def test_a_weak_or_unsafe_token_is_refused_without_being_repeated(secret):
    with pytest.raises(ConfigError) as caught:
        Token(secret)
    if secret:
        assert secret not in str(caught.value)
    assert "token_urlsafe(32)" in str(caught.value)


@given(st.text())
def test_only_the_exact_token_matches(text):
    assert Token(SECRET).matches(text) == (text == SECRET)


def test_a_lone_surrogate_does_not_match_the_token():
    assert not Token(SECRET).matches("\ud800")


def test_a_cookie_identifies_its_session_and_does_not_contain_the_token():
    token = Token(SECRET)
    cookie = token.issue()
    assert token.session(cookie) == cookie.partition(".")[0]
    assert SECRET not in cookie
    assert token.issue() != cookie


def test_a_cookie_is_valid_after_a_restart_with_the_same_token():
    assert Token(SECRET).session(Token(SECRET).issue()) is not None


def test_a_cookie_of_another_token_is_invalid():
    assert Token(new_token()).session(Token(SECRET).issue()) is None


@given(st.text())
def test_a_random_text_is_not_a_valid_cookie(text):
    assert Token(SECRET).session(text) is None


def test_a_cookie_is_not_a_valid_key_and_a_key_is_not_a_valid_cookie():
    token = Token(SECRET)
    cookie = token.issue()
    session = token.session(cookie)
    key = token.key(session)
    assert token.session_of_key(key) == session
    assert token.session_of_key(cookie) is None
    assert token.session(key) is None
    assert Token(new_token()).session_of_key(key) is None
    assert Token(SECRET).key(session) == key


def test_a_code_works_once_and_the_oldest_code_is_removed_at_the_limit():
    codes = Codes(life=10.0, limit=2)
    first, second, third = (codes.issue(0.0) for _ in range(3))
    assert not codes.use(first, 0.0)
    assert codes.use(second, 9.9)
    assert not codes.use(second, 9.9)
    assert not codes.use(third, 10.0)
    assert not codes.use("", 0.0)


def test_a_cookie_with_any_changed_character_is_invalid():
    token = Token(SECRET)
    cookie = token.issue()
    for at in range(len(cookie)):
        other = "0" if cookie[at] != "0" else "1"
        assert token.session(cookie[:at] + other + cookie[at + 1 :]) is None


def test_ten_failures_in_a_minute_make_an_address_wait():
    attempts = Attempts()
    for second in range(10):
        assert attempts.wait("a", float(second)) == 0
        attempts.failed("a", float(second))
    assert attempts.wait("a", 10.0) == 50
    assert attempts.wait("a", 59.5) == 1
    assert attempts.wait("b", 10.0) == 0
    assert attempts.wait("a", 60.0) == 0


def test_old_failures_are_not_counted():
    attempts = Attempts()
    for attempt in range(100):
        attempts.failed("a", attempt * 7.0)
        assert attempts.wait("a", attempt * 7.0) == 0


def test_the_address_with_the_oldest_failure_is_forgotten_first():
    attempts = Attempts(limit=1, addresses=2)
    for address in ("a", "b", "c"):
        attempts.failed(address, 0.0)
    assert [attempts.wait(address, 0.0) for address in "abc"] == [0, 60, 60]
