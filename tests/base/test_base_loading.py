"""Modules that are imported in another thread than the event loop's."""

import asyncio
import sys
import threading

import pytest

from webmap.base.processes import load, load_soon

TEXT = "import threading\nthread = threading.current_thread()\n"


@pytest.fixture
def heavy(tmp_path, monkeypatch):
    """The name of a module that records the thread that imports it."""
    (tmp_path / "webmap_heavy.py").write_text(TEXT)
    monkeypatch.syspath_prepend(tmp_path)
    yield "webmap_heavy"
    sys.modules.pop("webmap_heavy", None)


def test_a_module_is_imported_by_another_thread_once(heavy):
    async def scenario():
        await load(heavy)
        first = sys.modules[heavy]
        assert first.thread is not threading.current_thread()
        await load(heavy)
        assert sys.modules[heavy] is first

    asyncio.run(scenario())


def test_an_import_begins_without_being_awaited(heavy):
    async def scenario():
        load_soon(heavy)

    asyncio.run(scenario())  # waits for the threads
    assert sys.modules[heavy].thread is not threading.current_thread()


def test_without_an_event_loop_nothing_is_imported_ahead(heavy):
    load_soon(heavy)
    assert heavy not in sys.modules


def test_a_missing_module_is_an_error_of_who_waits_for_it():
    with pytest.raises(ModuleNotFoundError, match="webmap_nowhere"):
        asyncio.run(load("webmap_nowhere"))
