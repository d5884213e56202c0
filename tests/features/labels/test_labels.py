"""Labels on maps: shared, added on pages, saved on disk."""

import asyncio
import json

import pytest

from webmap import Map
from webmap.base.errors import ConfigError
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page

DESK = {"name": "Desk", "x": 1.0, "y": 2.0, "icon": "desk"}


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path / "state"))
    return tmp_path / "state" / "labels" / "labels.json"


@pytest.fixture
def said(monkeypatch):
    """The messages of modules to their browser parts."""
    sent = []
    monkeypatch.setattr(
        "webmap.core.world_view.BrowserPart.send",
        lambda self, message: sent.append(message),
    )
    return sent


def shown(layer) -> list[str]:
    return [label.get("data-name") for label in layer.svg.children]


async def saved(layer) -> None:
    while layer.added._saving is not None:
        await asyncio.sleep(0.005)


def test_a_label_is_found_by_its_name(map, page, said):
    async def scenario():
        labels = map.add_module("Labels", [DESK])
        labels.on_message({"add": {"name": "Dock", "x": 3, "y": 4}})
        labels.on_message({"add": {"name": "Desk", "x": 5, "y": 6}})
        assert map.find_module("Labels") is labels
        assert (labels.find("Dock").x, labels.find("Desk").x) == (3.0, 1.0)
        assert labels.find("Lift") is None
        assert map.find_module("MapFile") is None
        await saved(labels.layer)
        page.close()

    asyncio.run(scenario())


def test_an_added_label_is_on_every_map_and_is_saved(map, page, state, said):
    async def scenario():
        one = map.add_module("Labels", [DESK])
        other = Map(page.element("other"), 100, 100).add_module("Labels", [DESK])
        one.on_message({"add": {"name": "Dock", "x": 3, "y": 4, "icon": "charger"}})
        assert said == [{"done": True}]
        assert one.layer is other.layer
        assert shown(other.layer) == ["Desk", "Dock"]
        await saved(one.layer)
        page.close()
        assert one.layer.users == 0

    asyncio.run(scenario())
    kept = json.loads(state.read_text())
    assert kept == {
        "labels": [{"name": "Dock", "x": 3.0, "y": 4.0, "icon": "charger", "yaw": None}]
    }


def test_a_saved_label_is_shown_and_can_be_deleted(map, page, state, said):
    state.parent.mkdir(parents=True)
    state.write_text('{"labels": [{"name": "Old", "x": 0, "y": 0, "yaw": null}]}')

    async def scenario():
        module = map.add_module("Labels", [DESK])
        assert shown(module.layer) == ["Desk", "Old"]
        desk, old = (label.get("data-label") for label in module.layer.svg.children)
        module.on_message({"remove": desk})
        module.on_message({"remove": "nobody"})
        module.on_message({"remove": old})
        assert said == [
            {"refused": "Desk is in the configuration and cannot be deleted"},
            {"refused": "this label was already deleted"},
            {"done": True},
        ]
        await saved(module.layer)
        assert shown(module.layer) == ["Desk"]
        page.close()

    asyncio.run(scenario())
    assert json.loads(state.read_text()) == {"labels": []}


@pytest.mark.parametrize(
    ("add", "words"),
    [
        (
            {"name": "x", "x": None, "y": 0},
            "x: got the value None, expected a number of metres",
        ),
        (
            {"name": " ", "x": 0, "y": 0},
            'name: got the text " ", expected a text of 1 to 60 characters',
        ),
        ({"name": "x", "x": 0, "y": 0, "id": "c0"}, 'there is no key "id"'),
        ("x", "expected a table"),
    ],
)
def test_an_invalid_label_from_a_page_is_refused(map, page, said, add, words):
    async def scenario():
        module = map.add_module("Labels")
        module.on_message({"add": add})
        module.on_message({"nonsense": 1})
        assert module.layer.added.labels == {}
        page.close()

    asyncio.run(scenario())
    (answer,) = said
    assert words in answer["refused"]


def test_a_moved_label_moves_on_all_maps_and_is_saved(map, page, state, said):
    async def scenario():
        one = map.add_module("Labels", [DESK])
        other = Map(page.element("other"), 100, 100).add_module("Labels", [DESK])
        one.on_message(
            {"add": {"name": "Dock", "x": 3, "y": 4, "icon": "charger", "yaw": 1}}
        )
        desk, dock = other.layer.svg.children
        one.on_message({"move": dock.get("data-label"), "to": {"x": -1.5, "y": 7}})
        assert dock._transform == (-1.5, 7.0, 0.0)
        assert said == [{"done": True}] * 2
        for wrong, words in (
            ({"move": dock.get("data-label"), "to": {"x": 1}}, "y: got the value None"),
            ({"move": dock.get("data-label")}, "x and y, in metres"),
            ({"move": desk.get("data-label"), "to": {"x": 1, "y": 1}}, "configuration"),
            ({"move": "nobody", "to": {"x": 1, "y": 1}}, "already deleted"),
        ):
            one.on_message(wrong)
            assert words in said.pop()["refused"]
        await saved(one.layer)
        page.close()

    asyncio.run(scenario())
    (kept,) = json.loads(state.read_text())["labels"]
    assert kept == {"name": "Dock", "x": -1.5, "y": 7.0, "icon": "charger", "yaw": 1.0}


def test_maps_with_different_configured_labels_share_added_labels(
    map, page, state, said
):
    async def scenario():
        one = map.add_module("Labels", [DESK])
        other = Map(page.element("other"), 100, 100).add_module("Labels")
        one.on_message({"add": {"name": "Dock", "x": 3, "y": 4}})
        other.on_message({"add": {"name": "Door", "x": 5, "y": 6}})
        assert shown(one.layer) == ["Desk", "Dock", "Door"]
        assert shown(other.layer) == ["Dock", "Door"]
        dock = other.layer.svg.children[0].get("data-label")
        one.on_message({"move": dock, "to": {"x": 7, "y": 8}})
        assert other.layer.svg.children[0]._transform == (7.0, 8.0, 0.0)
        await saved(one.layer)
        names = [label["name"] for label in json.loads(state.read_text())["labels"]]
        assert names == ["Dock", "Door"]
        other.on_message({"remove": dock})
        assert shown(one.layer) == ["Desk", "Door"]
        await saved(one.layer)
        page.close()

    asyncio.run(scenario())
    (kept,) = json.loads(state.read_text())["labels"]
    assert kept["name"] == "Door"
    assert said == [{"done": True}] * 4


def test_the_label_file_is_read_again_after_its_last_map_was_removed(
    map, page, state, said
):
    async def scenario():
        module = map.add_module("Labels")
        module.on_message({"add": {"name": "Dock", "x": 3, "y": 4}})
        await saved(module.layer)
        map.remove_module(module)
        state.write_text('{"labels": [{"name": "Mended", "x": 0, "y": 0}]}')
        assert shown(map.add_module("Labels").layer) == ["Mended"]
        page.close()

    asyncio.run(scenario())


def test_a_map_added_later_also_shows_the_problem_of_unsaved_labels(
    map, page, channel, state, said
):
    async def scenario():
        module = map.add_module("Labels")
        state.parent.parent.mkdir(parents=True)
        state.parent.write_text("a file where a folder is to be")
        module.on_message({"add": {"name": "Dock", "x": 3, "y": 4}})
        await saved(module.layer)
        later = Map(page.element("other"), 100, 100).add_module("Labels", [DESK])
        (words,) = later.layer.problems.values()
        assert "labels are not kept" in words
        state.parent.unlink()
        module.on_message({"add": {"name": "Door", "x": 5, "y": 6}})
        await saved(module.layer)
        assert not later.layer.problems
        assert not module.layer.problems
        page.close()

    asyncio.run(scenario())
    assert len(json.loads(state.read_text())["labels"]) == 2


def test_a_viewer_cannot_add_labels(channel, tmp_path, said):
    entry = PageEntry("/", lambda page: None, None, tmp_path, "test")
    page = Page(entry, channel, Viewer("v", "V", "viewer"), None, {})
    module = Map(page.element("map"), 700, 500).add_module("Labels")
    module.on_message({"add": DESK})
    assert said == [{"refused": "only admins can add, move and delete labels"}]
    assert module.layer.added.labels == {}
    page.close()


def test_an_unreadable_label_file_is_a_problem_and_is_not_overwritten(
    map, page, channel, state, said
):
    state.parent.mkdir(parents=True)
    state.write_text("{broken")
    module = map.add_module("Labels", [DESK])
    assert shown(module.layer) == ["Desk"]
    assert "added labels are not shown" in channel.errors[0]
    module.on_message({"add": {"name": "Dock", "x": 3, "y": 4}})
    assert "cannot be read and is left unchanged" in said[0]["refused"]
    assert state.read_text() == "{broken"
    page.close()


def test_a_failed_save_of_labels_is_shown_on_the_page(map, page, channel, state, said):
    state.parent.parent.mkdir(parents=True)
    state.parent.write_text("a file where a folder is to be")

    async def scenario():
        module = map.add_module("Labels")
        assert module.layer.added.readable is False or module.layer.added.labels == {}
        module.layer.added.readable = True
        module.on_message({"add": DESK})
        await saved(module.layer)
        page.close()

    asyncio.run(scenario())
    assert any("labels are not kept" in words for words in channel.errors)


def test_labels_of_a_file_follow_labels_of_the_program(map, page, tmp_path):
    (tmp_path / "places.yaml").write_text("- {name: Lift, x: 1, y: 2, icon: lift}")
    module = map.add_module("Labels", [DESK], file=tmp_path / "places.yaml")
    assert shown(module.layer) == ["Desk", "Lift"]
    page.close()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"labels": [{"name": "x"}]}, r"labels\[0\]: the key .x. is missing"),
        ({"key": "ll"}, "key must be one character"),
        ({"name": "../x"}, "letters, digits"),
        ({"file": "/no/such"}, "No such file"),
    ],
)
def test_invalid_options_are_refused(map, options, words):
    with pytest.raises(ConfigError, match=words):
        map.add_module("Labels", **options)
    assert map.modules == []
