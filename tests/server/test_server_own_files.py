"""All addresses of WebMap's own files change when one of the files changes."""

import pytest

from webmap.server import own_files
from webmap.server.files import NoSuchFile


@pytest.fixture
def package(tmp_path, monkeypatch):
    for name, text in {
        "web/opening.js": "export const opening = 1;\n",
        "web/page.js": "export const page = 1;\n",
        "web/drive.js": "export const drive = 1;\n",
        "features/stop/stop_button.js": "export default function attach() {}\n",
        "features/drive/teleop.js": "export default function attach() {}\n",
        "console/page.py": "secret = 1\n",
        "assets/icon.svg": "<svg/>",
    }.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.setattr(own_files, "PACKAGE", tmp_path)
    monkeypatch.setattr(own_files, "ASSETS", tmp_path / "assets")
    return tmp_path


def test_a_changed_file_gives_all_files_a_new_version(package):
    files = own_files.OwnFiles()
    first = files.version()
    assert files.version() == first
    (package / "web/page.js").write_text("export const page = 22;\n")
    second = files.version()
    assert second != first
    file = files.file(f"v-{second}/web/page.js")
    assert file.unchanging
    assert b"page = 22" in file.data
    old = files.file(f"v-{first}/web/page.js")
    assert (old.data, old.unchanging) == (file.data, False)


def test_a_new_file_is_found_when_another_one_changes(package):
    files = own_files.OwnFiles()
    files.version()
    (package / "web/new.js").write_text("export const other = 1;\n")
    (package / "web/drive.js").write_text('import { other } from "./new.js";\n')
    assert b"other = 1" in files.file(f"v-{files.version()}/web/drive.js").data


def test_the_same_files_have_the_same_version(package):
    assert own_files.OwnFiles().version() == own_files.OwnFiles().version()


@pytest.mark.parametrize(
    "name",
    [
        "console/page.py",
        "../web/page.js",
        "v-1/web/page.js",
        "web",
        "",
        "assets/icon.svg",
    ],
)
def test_only_files_for_browsers_are_served(package, name):
    files = own_files.OwnFiles()
    assert files.file("icon.svg").data == b"<svg/>"
    with pytest.raises(NoSuchFile):
        files.file(name)
