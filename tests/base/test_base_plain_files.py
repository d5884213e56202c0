"""Files that users name, and paths that are not regular files."""

import errno
import os
import socket

import pytest

from webmap.base import lined_yaml
from webmap.base.errors import ConfigError
from webmap.base.lined_yaml import LinedYaml
from webmap.base.plain_files import read_file, refuse_special, resolved, write_file

pytestmark = pytest.mark.slow


def test_a_file_is_read_through_a_symbolic_link(tmp_path):
    (tmp_path / "a").write_bytes(b"abc")
    (tmp_path / "b").symlink_to("a")
    assert read_file(tmp_path / "b", 3) == b"abc"


def test_a_pipe_is_refused_without_waiting(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ConfigError, match="pipe: expected a file, got a pipe"):
        read_file(tmp_path / "pipe", 10)


def test_folders_devices_and_sockets_are_refused(tmp_path, monkeypatch):
    with pytest.raises(ConfigError, match="got a folder"):
        read_file(tmp_path, 10)
    (tmp_path / "zero").symlink_to("/dev/zero")
    with pytest.raises(ConfigError, match="got a device"):
        read_file(tmp_path / "zero", 10)
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket")
        with pytest.raises(OSError, match="No such device"):
            read_file(tmp_path / "socket", 10)


def test_a_file_that_is_too_large_is_refused(tmp_path):
    (tmp_path / "a").write_bytes(b"x" * ((1 << 20) + 1))
    with pytest.raises(ConfigError, match="larger than 1 MiB"):
        read_file(tmp_path / "a", 1 << 20)


def test_writing_a_file_creates_its_folder(tmp_path):
    file = tmp_path / "new" / "a.json"
    write_file(file, b"one")
    write_file(file, b"two")
    assert file.read_bytes() == b"two"
    assert list(file.parent.iterdir()) == [file]


def test_two_simultaneous_writes_of_a_file_do_not_disturb_each_other(
    tmp_path, monkeypatch
):
    file = tmp_path / "a.json"
    written = []

    def while_that_goes_to_the_disk(number):
        if not written:
            written.append(number)
            write_file(file, b"second")
            assert file.read_bytes() == b"second"

    monkeypatch.setattr(os, "fsync", while_that_goes_to_the_disk)
    write_file(file, b"the first")
    assert file.read_bytes() == b"the first"
    assert list(tmp_path.iterdir()) == [file]


def test_a_failed_write_on_a_full_disk_keeps_the_old_file(tmp_path, monkeypatch):
    file = tmp_path / "a.json"
    write_file(file, b"before")

    def full(number):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_file(file, b"after")
    assert file.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [file]


def test_yaml_errors_name_the_line_of_the_value(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("# places\nlabels:\n  - name: A\n    x: 1\n  - {x: 2}\n")
    parsed = LinedYaml(file)
    assert parsed.data == {"labels": [{"name": "A", "x": 1}, {"x": 2}]}
    ways = [("labels",), ("labels", 0, "x"), ("labels", 1, "name"), ("none",)]
    lines = [str(parsed.wrong(way, "?")).split(":")[1] for way in ways]
    assert lines == ["2", "4", "5", "2"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a: 1\nb: &x [1]\nc: *x\n", ":3: this is not YAML: aliases (*name) are not"),
        ("a: 1\na: 2\n", ':2: this is not YAML: the key "a" is defined twice'),
        ("a: 1\nb: [\n", ":3: this is not YAML: "),
        ("a: !!python/object:os.system {}\n", ":1: this is not YAML: could not"),
        ("a: 2001-99-99\n", ": this is not YAML: month must be in 1..12"),
        ("\x00", ": this is not YAML: "),
        ("[" * 5000, ":1: this is not YAML: values are nested more than 50 deep"),
    ],
)
def test_invalid_yaml_is_refused_with_its_line(tmp_path, text, expected):
    file = tmp_path / "a.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError) as error:
        LinedYaml(file)
    assert str(error.value).startswith(f"{file}{expected}")


def test_control_characters_are_escaped_in_yaml_errors(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("a: 1\n")
    assert str(LinedYaml(file).wrong(("a",), "\x1b[2J")) == f"{file}:1: \\x1b[2J"


def test_circular_symbolic_links_are_refused_with_a_clear_error(tmp_path):
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises((ConfigError, OSError), match="symbolic links"):
        read_file(resolved(tmp_path / "a"), 10)


def test_a_path_with_a_null_character_is_refused_with_a_clear_error(tmp_path):
    for look in (resolved, lambda path: read_file(path, 10)):
        with pytest.raises(ConfigError, match="is not a path: expected a text without"):
            look(tmp_path / "a\0b")


def test_pipes_and_devices_are_refused_but_folders_are_accepted(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "zero").symlink_to("/dev/zero")
    for name, kind in (("pipe", "a pipe"), ("zero", "a device")):
        with pytest.raises(ConfigError, match=f"a file or a folder, got {kind}"):
            refuse_special(tmp_path / name)
    refuse_special(tmp_path)


def test_a_socket_is_refused_and_a_path_that_leads_nowhere_is_a_path(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket")
        with pytest.raises(ConfigError, match="got a socket"):
            refuse_special(tmp_path / "socket")
    assert resolved(tmp_path / "nowhere") == (tmp_path / "nowhere").resolve()


def test_a_file_that_webmap_keeps_is_private_and_no_link(tmp_path):
    write_file(tmp_path / "a", b"abc")
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o600
    (tmp_path / "b").symlink_to("a")
    with pytest.raises(OSError, match="symbolic link"):
        read_file(tmp_path / "b", 3, links=False)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 5000, "nested more than 50 deep"),
        ("[" * 51 + "]" * 51, "nested more than 50 deep"),
        ('{"a":' * 60 + "1" + "}" * 60, "nested more than 50 deep"),
        ("- 1\n" * 500, "more than 400 keys and values"),
        ("a: " + "1:" * 5000 + "1", "a number has more than 100 characters"),
        ("a: " + "1" * 200 + ".5", "a number has more than 100 characters"),
        ("a: &a [1]\nb: *a", "aliases"),
        ("#" * (1 << 18) + "#", "larger than 256 KiB"),
    ],
)
def test_too_large_or_too_complex_yaml_is_refused(tmp_path, monkeypatch, text, words):
    monkeypatch.setattr(lined_yaml, "MOST_VALUES", 400)
    file = tmp_path / "a.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=words):
        LinedYaml(file)


def test_a_long_digit_text_is_accepted_if_values_are_read_as_texts(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("a: " + "1" * 200)
    assert LinedYaml(file, texts=True).data == {"a": "1" * 200}
