"""A recording that may lack messages is not written."""

import pytest
import test_wires_drives
import test_wires_sources
import wires_recording

WHOLE = "== pipe\nready\nrobot\n"
SHORT = "== pipe\nready\n"
DRIVES = test_wires_drives, "messages_of_each_scripted_drive"
SOURCES = test_wires_sources, "robots_of_each_source"


@pytest.mark.parametrize(("module", "what"), [DRIVES, SOURCES])
def test_a_recording_that_is_not_the_same_twice_is_not_written(
    module, what, monkeypatch, tmp_path, tmp_path_factory, request
):
    plays = iter([{"short": SHORT, "whole": WHOLE}, {"short": WHOLE, "whole": WHOLE}])
    monkeypatch.setattr(module, "WRITES", True)
    monkeypatch.setattr(wires_recording, "WRITES", True)
    monkeypatch.setattr(wires_recording, "FOLDER", tmp_path)
    monkeypatch.setattr(module, "played", lambda *_: next(plays))
    check = getattr(module, f"test_the_{what}_match_the_recording")
    make = module.recordings.__wrapped__
    recordings = make(tmp_path_factory, request)
    check(recordings, "whole")
    with pytest.raises(AssertionError, match="not the same twice"):
        check(recordings, "short")
    written = {file.name: file.read_text("utf-8") for file in tmp_path.iterdir()}
    assert written == {"whole.txt": WHOLE}
