import os

import pytest

from webmap.base.errors import ConfigError
from webmap.server.files import NoSuchFile, Published, read_below, read_file

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture
def folder(tmp_path):
    inside = tmp_path / "site"
    (inside / "images").mkdir(parents=True)
    (inside / "images" / "robot.png").write_bytes(PNG)
    (inside / "style.css").write_text("a{}")
    (inside / ".hidden.css").write_text("a{}")
    (inside / "main.py").write_text("secret")
    (inside / "data.json").write_text("{}")
    (inside / "page.html").write_text("<p>")
    (inside / "noend").write_text("x")
    (tmp_path / "secret.css").write_text("secret")
    (inside / "out.css").symlink_to(tmp_path / "secret.css")
    (inside / "in.css").symlink_to(inside / "style.css")
    (inside / "up").symlink_to(tmp_path)
    (inside / "dir.css").mkdir()
    os.mkfifo(inside / "pipe.css")
    (inside / "device.png").symlink_to("/dev/zero")
    return inside


@pytest.mark.parametrize(
    ("name", "media_type"),
    [
        ("style.css", "text/css; charset=utf-8"),
        ("images/robot.png", "image/png"),
        ("in.css", "text/css; charset=utf-8"),
    ],
)
def test_a_file_of_the_folder_is_read(folder, name, media_type):
    assert read_below(folder, name).media_type == media_type


@pytest.mark.parametrize(
    "name",
    [
        "",
        "/",
        "nothing.css",
        "../secret.css",
        "images/../style.css",
        "images/../../secret.css",
        "./style.css",
        "/etc/passwd",
        "//host/share.css",
        "\\\\host\\share.css",
        "..\\secret.css",
        "c:style.css",
        "style.css:stream.css",
        "style.css\0.png",
        "style.css/",
        "images//robot.png",
        ".hidden.css",
        "main.py",
        "data.json",
        "page.html",
        "noend",
        "out.css",
        "up/secret.css",
        "dir.css",
        "pipe.css",
        "device.png",
        "style.css ",
        "style.css.",
        "a" * 5000 + ".css",
        "\ud800.css",
    ],
)
def test_every_other_name_is_refused(folder, name):
    with pytest.raises(NoSuchFile):
        read_below(folder, name)


def test_a_missing_folder_has_no_files(tmp_path):
    with pytest.raises(NoSuchFile):
        read_below(tmp_path / "gone", "style.css")


def test_a_symbolic_link_in_place_of_a_file_is_not_followed(folder):
    with pytest.raises(NoSuchFile):
        read_file(folder / "out.css")


def test_a_changed_file_has_another_tag(folder):
    before = read_below(folder, "style.css").tag
    (folder / "style.css").write_text("a{color:red}")
    assert read_below(folder, "style.css").tag != before


def test_a_published_file_is_read_again_each_time(folder):
    published = Published()
    url = published.publish_file(folder / "style.css")
    name = url.removeprefix("/_webmap/files/")
    assert published.file(name).data == b"a{}"
    (folder / "style.css").write_text("b{}")
    assert published.file(name).data == b"b{}"
    assert published.publish_file(folder / "style.css") == url


def test_files_of_one_folder_share_a_url_folder_and_only_published_ones_are_served(
    folder,
):
    published = Published()
    (folder / "a.js").write_text("")
    (folder / "b.js").write_text("")
    first = published.publish_file(folder / "a.js")
    name = first.removeprefix("/_webmap/files/").replace("a.js", "b.js")
    with pytest.raises(NoSuchFile):
        published.file(name)
    assert published.publish_file(folder / "b.js") == first.replace("a.js", "b.js")
    assert published.file(name).data == b""


@pytest.mark.parametrize("name", ["nothing.js", "main.py", "dir.css", "pipe.css"])
def test_a_file_that_cannot_be_published_is_refused_at_once(folder, name):
    with pytest.raises(ConfigError, match=name.partition(".")[0]):
        Published().publish_file(folder / name)


def test_equal_images_have_the_same_url_and_different_images_different_urls():
    published = Published()
    first = published.publish_image(PNG, "image/png")
    assert published.publish_image(PNG, "image/png") == first
    assert published.publish_image(PNG + b"x", "image/png") != first


def test_an_image_is_served_until_withdrawn_as_often_as_published():
    published = Published()
    url = published.publish_image(PNG, "image/png")
    published.publish_image(PNG, "image/png")
    tag = url.removeprefix("/_webmap/images/")
    published.withdraw_image(url)
    assert published.image(tag).data == PNG
    published.withdraw_image(url)
    with pytest.raises(NoSuchFile):
        published.image(tag)
    published.withdraw_image(url)


def test_the_type_of_an_image_file_is_taken_from_its_suffix(folder):
    url = Published().publish_image(folder / "images" / "robot.png")
    assert url == Published().publish_image(PNG, "image/png")


@pytest.mark.parametrize("media_type", [None, "", "text/html", "image/x-unknown"])
def test_a_media_type_that_is_not_an_image_is_refused(media_type):
    with pytest.raises(ConfigError, match="an image is one of"):
        Published().publish_image(PNG, media_type)


def test_a_missing_image_is_named_in_the_error(tmp_path):
    with pytest.raises(ConfigError, match=r"plan\.png"):
        Published().publish_image(tmp_path / "plan.png")
