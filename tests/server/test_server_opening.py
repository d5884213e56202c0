"""The command that opens a browser shows no secret to other users of the machine."""

import contextlib
import re
import stat
import tempfile
import threading
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from equipment.server_fakes import FakeGate, FakeModel, FakePage, FakeSite
from webmap.base.errors import ConfigError
from webmap.server import application, runner
from webmap.server.app import WebApp

URL = "http://127.0.0.1:8000/"


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    (tmp_path / "home").mkdir()
    return tmp_path / "home"


@pytest.fixture
def browser(monkeypatch):
    """Return the command line of the browser after it was opened."""
    there, arguments = threading.Event(), []

    def opens(*args, **options):
        arguments.extend([*args, *options.values()])
        there.set()
        return True

    def wait():
        assert there.wait(10)
        return arguments

    monkeypatch.setattr("webbrowser.open", opens)
    return wait


def file_of(arguments):
    (address,) = arguments
    parts = urlsplit(address)
    assert parts.scheme == "file"
    return Path(unquote(parts.path))


def test_the_browser_opens_a_file_that_only_its_owner_can_read(browser, home):
    with runner.browser_at(URL, "the-code"):
        file = file_of(browser())
        assert file.parent == home
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
        assert f'url={URL}?webmap_code=the-code"' in file.read_text()
        assert "the-code" not in str(browser())
    assert list(home.iterdir()) == []


def test_the_file_is_removed_when_its_code_expires(browser, home, monkeypatch):
    monkeypatch.setattr(runner, "CODE_LIFE_S", 0.0)
    gone = threading.Event()
    monkeypatch.setattr(Path, "unlink", lambda *_, **__: gone.set())
    with runner.browser_at(URL, "the-code"):
        assert gone.wait(10)


def test_without_a_writable_home_the_file_is_in_the_temporary_folder(browser, home):
    home.rmdir()
    (home.parent / "tmp").mkdir()
    with runner.browser_at(URL, "the-code"):
        assert file_of(browser()).parent == home.parent / "tmp"


def test_without_a_writable_folder_the_log_refers_to_the_printed_address(home, caplog):
    home.rmdir()
    with runner.browser_at(URL, "the-code"):
        assert "open the printed address yourself" in caplog.text
    assert "the-code" not in caplog.text


def test_run_prints_the_token_and_opens_an_address_that_works_once(
    browser, capsys, monkeypatch, make_client
):
    app = WebApp(FakeSite(FakePage("/")), FakeModel(), FakeGate())
    monkeypatch.setattr(application, "_make_app", lambda *_, **__: app)
    monkeypatch.setattr(application, "runtime", FakeRuntime())
    monkeypatch.setattr(application, "has_run", False)

    def serve(app, *, on_ready, **_):
        on_ready(f"{URL}?token={app.settings.token}")
        text = file_of(browser()).read_text()
        location = re.search(r'url=http://127\.0\.0\.1:8000(/[^"]*)"', text)[1]
        assert app.settings.token not in text
        assert make_client(app).get(location).status_code == 200
        assert make_client(app).get(location).status_code == 401

    monkeypatch.setattr("webmap.server.runner.serve", serve)
    with contextlib.suppress(KeyboardInterrupt):
        application.run(port=0, open_browser=True)
    assert f"?token={app.settings.token}\n" in capsys.readouterr().out
    assert app.settings.token not in str(browser())


class FakeRuntime:
    def start(self):
        pass

    def stop(self):
        pass


def test_run_limits_the_pages_to_the_number_that_it_is_given(monkeypatch):
    found = []

    def make(settings, **_):
        found.append(settings.max_pages)
        raise KeyboardInterrupt

    monkeypatch.setattr(application, "_make_app", make)
    monkeypatch.setattr(application, "has_run", False)
    for options in ({}, {"max_pages": 500}):
        with contextlib.suppress(KeyboardInterrupt):
            application.run(port=0, **options)
    assert found == [100, 500]


def test_an_application_limits_the_pages_to_the_number_that_it_is_given():
    assert application.asgi_app(max_pages=3).settings.max_pages == 3


@pytest.mark.parametrize("start", [application.run, application.asgi_app])
def test_no_pages_at_all_are_refused(start):
    with pytest.raises(ConfigError, match="max_pages must be at least 1, got 0"):
        start(max_pages=0)


@pytest.mark.parametrize("start", [application.run, application.asgi_app])
@pytest.mark.parametrize("rate", [0.5, 61.0, float("nan")])
def test_a_frame_rate_that_is_none_is_refused(start, rate):
    with pytest.raises(ConfigError, match="frame_rate must be from 1 to 60, got"):
        start(frame_rate=rate)


def test_the_frame_rate_is_that_of_the_model(monkeypatch):
    monkeypatch.setattr(application.runtime, "frame_rate", 60.0)
    application.asgi_app(frame_rate=5)
    assert application.runtime.frame_rate == 5
