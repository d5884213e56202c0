"""A warning about passwords in a fleet file that other users can read."""

import pytest

from webmap.config.toml_text import readable_secret
from webmap.fleet.fleet_file import prepare

HEAD = '[bridges]\nb = "ws://robot:9090"\n[[robots]]\nname = "Bob"\nbridge = "b"\n'
CAMERA = 'cameras = ["http://{}"]\n'


@pytest.fixture
def warned(tmp_path, caplog):
    """Read a file with this mode; return the log messages."""

    def read(text, mode, name="my fleet.toml"):
        file = tmp_path / name
        file.write_text(text)
        file.chmod(mode)
        prepare(file)
        return [r.getMessage() for r in caplog.records if r.name == "webmap.cli"]

    return read


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o604, 0o620])
@pytest.mark.parametrize(
    "text",
    [
        HEAD + CAMERA.format("ann:word@cam.local/stream"),
        HEAD + CAMERA.format("cam.local/stream?topic=/a&access_token=word"),
        HEAD + CAMERA.format("cam.local/stream?pwd=word"),
        HEAD.replace("robot:9090", "robot:9090/?token=word"),
    ],
)
def test_a_password_readable_by_other_users_causes_a_warning(warned, text, mode):
    (warning,) = warned(text, mode)
    assert "my fleet.toml contains a password, and other users of this comp" in warning
    assert f"(its mode is {mode:04o}): run chmod 600 '/" in warning
    assert warning.endswith("/my fleet.toml'")
    assert "word@" not in warning


@pytest.mark.parametrize(
    ("data", "is_one"),
    [
        ({"robots": [{"modules": [{"options": {"password": "word"}}]}]}, True),
        ({"camera_token": "word"}, True),
        ({"api-key": "word"}, True),
        ({"password": ""}, False),
        ({"passage": "word", "keyboard": "word", "author": "word"}, False),
        ({"url": "ftp://[bad", "token": 5}, False),
    ],
)
def test_passwords_are_recognised_by_the_name_of_their_field(tmp_path, data, is_one):
    file = tmp_path / "fleet.toml"
    file.touch(0o644)
    assert (readable_secret(file, data) is not None) == is_one


@pytest.mark.parametrize("mode", [0o600, 0o400, 0o700])
def test_a_private_file_with_a_password_causes_no_warning(warned, mode):
    assert warned(HEAD + CAMERA.format("ann:word@cam.local/"), mode) == []


def test_a_file_without_a_password_causes_no_warning(warned):
    text = HEAD + CAMERA.format("cam.local:8080/stream?topic=/a@b&type=mjpeg")
    assert warned(text, 0o644) == []
