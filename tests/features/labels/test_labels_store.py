"""Places with a name: which are valid, and how they are saved."""

import json
import os

import pytest

from webmap.base.errors import ConfigError
from webmap.features.labels.label_store import (
    ICONS,
    Label,
    LabelStore,
    given_labels,
    label_file,
    new_label,
)

DOCK = {"name": "Dock", "x": 1, "y": -2.5, "icon": "charger", "kind": "a-b", "yaw": 3}


def test_a_list_of_tables_is_read_as_labels():
    one, two = given_labels([DOCK, {"name": " Tür <b> ", "x": 0, "y": 0}], "it")
    assert one == Label("Dock", 1.0, -2.5, "charger", "a-b", 3.0, "c0")
    assert (two.name, two.icon, two.kind, two.yaw) == ("Tür <b>", "pin", "", None)
    assert given_labels({"labels": [DOCK]}, "it") == (one,)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"name": ""},
            'it[0].name: got the text "", expected a text of 1 to 60 characters',
        ),
        ({"name": "x" * 61}, "expected a text of 1 to 60"),
        ({"name": 5}, "it[0].name: got the whole number 5, expected a text"),
        ({"x": "1"}, 'it[0].x: got the text "1", expected a number of metres'),
        ({"x": None}, "it[0].x: got the value None, expected a number of metres"),
        ({"x": True}, "it[0].x: got the boolean true, expected a number"),
        (
            {"y": float("nan")},
            "it[0].y: got the number nan, expected a number of metres",
        ),
        ({"y": 1e7}, "it[0].y: got the number 10000000.0, expected a number"),
        (
            {"yaw": "north"},
            'it[0].yaw: got the text "north", expected a number of radians',
        ),
        (
            {"icon": "rocket"},
            'it[0].icon: got the text "rocket", expected "pin" or "charger"',
        ),
        ({"icon": ["pin"]}, "it[0].icon: got the array"),
        (
            {"kind": "a b"},
            'it[0].kind: got the text "a b", expected the name of a class',
        ),
        (
            {"nmae": "x"},
            'it[0].nmae: there is no key "nmae" here; did you mean "name"?',
        ),
    ],
)
def test_an_invalid_label_is_refused_with_its_field(change, words):
    with pytest.raises(ConfigError) as error:
        given_labels([{**DOCK, **change}], "it")
    assert words in str(error.value)


@pytest.mark.parametrize("data", [None, 3, "text", {"label": []}, [1], [[]]])
def test_data_other_than_a_list_of_tables_is_refused(data):
    with pytest.raises(ConfigError, match=r"expected|there is no key"):
        given_labels(data, "it")


def test_more_than_2000_labels_are_refused():
    with pytest.raises(ConfigError, match="expected at most 2000 labels"):
        given_labels([DOCK] * 2001, "it")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.yaml", "- name: Dock\n  x: 1\n  y: -2.5\n"),
        ("a.yaml", "labels:\n- {name: Dock, x: 1, y: -2.5}\n"),
        ("a.json", json.dumps([{"name": "Dock", "x": 1, "y": -2.5}])),
    ],
)
def test_a_label_file_may_be_yaml_or_json(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    (label,) = label_file(tmp_path / name)
    assert (label.name, label.x, label.y) == ("Dock", 1.0, -2.5)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "got the value None, expected a list of labels"),
        (b"- name: [", r"a\.yaml:1: this is not YAML"),
        (b"\xff\xfe\x00", "this is not YAML"),
        (b"!!python/object/apply:os.system ['true']", "not YAML"),
        (b"[" * 50_000, "nested more than 50 deep"),
        (b"a: &a [1]\nb: *a", r"a\.yaml:2: this is not YAML: aliases"),
        (
            b"- {name: A, x: 1, y: 2}\n- {}\n",
            r"a\.yaml:2: labels\[1\]: the key \"name\" is m",
        ),
        (
            b"labels:\n- name: A\n  x: 1\n  y: '2'\n",
            r":4: labels\[0\]\.y: got the text",
        ),
        (
            b"- name: A\n  x: 1\n  y: 2\n  iocn: pin\n",
            r":4: labels\[0\]\.iocn: there is no",
        ),
        (
            b"- name: A\n  x: 1\n  y: 2\n  it's: 3\n",
            r":4: labels\[0\]\.it's: there is no",
        ),
        (b"x" * (1 << 20) + b"xx", "larger than 256 KiB"),
    ],
)
def test_an_invalid_or_missing_label_file_is_refused(tmp_path, data, words):
    (tmp_path / "a.yaml").write_bytes(data)
    with pytest.raises(ConfigError, match=words):
        label_file(tmp_path / "a.yaml")
    with pytest.raises(ConfigError, match="No such file"):
        label_file(tmp_path / "b.yaml")


def test_saved_labels_are_loaded_again(tmp_path):
    store = LabelStore(tmp_path, "hall")
    assert store.load() == ()
    store.save([new_label(DOCK), new_label({"name": "Ü", "x": 0, "y": 0})])
    one, two = LabelStore(tmp_path, "hall").load()
    assert (one.name, one.icon, one.kind, one.yaw) == ("Dock", "charger", "a-b", 3.0)
    assert (two.name, two.kept) == ("Ü", True)
    assert one.id != two.id
    assert [file.name for file in (tmp_path / "labels").iterdir()] == ["hall.json"]


@pytest.mark.parametrize(
    "data", [b"", b"{", b'{"labels": [{"name": 1}]}', b"\xff", b"[" * 100_000]
)
def test_a_broken_file_of_saved_labels_is_refused(tmp_path, data):
    store = LabelStore(tmp_path, "hall")
    store.file.parent.mkdir()
    store.file.write_bytes(data)
    with pytest.raises(ConfigError):
        store.load()


def test_a_pipe_in_place_of_saved_labels_is_refused(tmp_path):
    store = LabelStore(tmp_path, "hall")
    store.file.parent.mkdir()
    os.mkfifo(store.file)
    with pytest.raises(ConfigError, match="got a pipe"):
        store.load()


@pytest.mark.parametrize("name", ["", "../x", "a/b", "a.b", "x" * 41])
def test_an_invalid_store_name_is_refused(tmp_path, name):
    with pytest.raises(ConfigError, match="letters, digits"):
        LabelStore(tmp_path, name)


def test_every_icon_has_only_svg_path_characters():
    for path in ICONS.values():
        assert set(path) <= set("MmLlHhVvCcSsAazZ0123456789.- ")
