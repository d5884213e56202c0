"""The code of other folders that the gate imports: the tests run every branch."""

import asyncio
import logging
import subprocess
import sys
import tomllib
from pathlib import Path

import msgspec
import pytest

from webmap.base.errors import ProtocolError
from webmap.base.geometry import Affine, Pose
from webmap.base.logs import OutsideText, budgets
from webmap.base.nesting import MAX_DEPTH
from webmap.base.scope import Removal, Scope, break_off
from webmap.ros.arrays import Floats, dec_hook
from webmap.ros.decoding import decode_json
from webmap.ros.limits import GENERAL, check_items, check_size
from webmap.ros.rosbridge import cbor, ops

LOADED = """
import sys
import webmap.gate.__main__, webmap.gate.display.client, webmap.ros.rosbridge.cbor
print(*(name for name in sys.modules if name.startswith("webmap.")))
"""


def test_coverage_counts_every_module_that_the_gate_imports() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LOADED], capture_output=True, text=True, check=True
    )
    ours = {name for name in done.stdout.split() if name.split(".")[1] != "gate"}
    config = Path(__file__).with_name("coverage.toml").read_text()
    counted = set(tomllib.loads(config)["tool"]["coverage"]["run"]["source"])
    folders = {"webmap.base", "webmap.config", "webmap.ros", "webmap.ros.foxglove"}
    folders |= {"webmap.ros.rosbridge", "webmap.ros.sockets"}
    assert counted == (ours - folders) | {"webmap.gate"}


def test_a_pose_converts_to_a_transform() -> None:
    assert Affine.of_pose(Pose(1.0, 2.0, 0.0)).values == (1.0, 0.0, 0.0, 1.0, 1.0, 2.0)


def test_a_log_record_whose_traceback_cannot_be_shown_is_still_logged() -> None:
    class Odd(Exception):
        def __str__(self) -> str:
            raise KeyError

    about = (Odd, Odd(), "no traceback")
    record = logging.LogRecord("webmap", logging.ERROR, "", 0, "it failed", (), about)  # type: ignore[arg-type]
    assert OutsideText(budgets).filter(record)
    assert record.exc_text == "  the traceback cannot be shown"


def test_a_scope_closes_even_if_a_removal_raises(
    caplog: pytest.LogCaptureFixture,
) -> None:
    removed = []
    scope = Scope("Bob")
    thing = Removal(lambda: removed.append("first"))
    scope.add(thing)
    scope.add(Removal(lambda: 1 / 0))
    scope.close()
    thing.remove()
    assert removed == ["first"]
    assert "scope 'Bob': a removal failed" in caplog.text


def test_a_future_is_cancelled_from_a_thread_without_a_running_loop() -> None:
    loop = asyncio.new_event_loop()
    future = loop.create_future()
    break_off(future)
    assert future.cancelled()
    loop.close()


def test_arrays_show_their_length_and_refuse_other_types() -> None:
    assert repr(Floats.from_wire([1.0, 2.0])) == "<Floats of 2>"
    with pytest.raises(NotImplementedError, match="a message cannot hold"):
        dec_hook(set, [])


@pytest.mark.parametrize(("inside", "type"), [('"\\ud800"', list), ("NaN", int)])
def test_non_strict_json_is_also_refused_if_nested_too_deeply(
    inside: str, type: object
) -> None:
    text = "[" * (MAX_DEPTH + 1) + inside + "]" * (MAX_DEPTH + 1)
    with pytest.raises(ProtocolError, match="nested deeper"):
        decode_json(text.encode(), type)


def test_data_within_the_limits_passes() -> None:
    check_size(GENERAL.size, GENERAL, None)
    check_items("points", 1)


@pytest.mark.parametrize(
    ("frame", "why"),
    [
        (b"\x01", "expected a map in CBOR, got int"),
        (b"\xa1\x61a\x5b\x7f\xff\xff\xff\xff\xff\xff\xff", "CBOR"),
    ],
)
def test_invalid_cbor_and_cbor_without_a_map_are_refused(
    frame: bytes, why: str
) -> None:
    with pytest.raises(ProtocolError, match=why):
        cbor.decode(frame)


def test_rosbridge_operations_are_encoded_as_json_or_raise_an_error() -> None:
    assert msgspec.json.decode(ops.status("info", "ready")) == {
        "op": "status",
        "level": "info",
        "msg": "ready",
    }
    deep: list[object] = []
    for _ in range(100_000):
        deep = [deep]
    with pytest.raises(ValueError, match="nested too deeply"):
        ops.publish("/deep", {"data": deep})
