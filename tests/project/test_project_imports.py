"""The modules that an import loads: they affect the start time and what can fail."""

import subprocess
import sys

import pytest

HEAVY = {"PIL", "cbor2", "click", "numpy", "starlette", "uvicorn", "yaml"}


def loaded_by(statement: str) -> set[str]:
    """Return the top-level modules of a new interpreter after a statement."""
    return {name.partition(".")[0] for name in modules_after(statement)}


def modules_after(statement: str) -> list[str]:
    program = f"{statement}\nimport sys; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    return done.stdout.split()


def test_the_import_check_detects_heavy_packages() -> None:
    assert {"numpy", "starlette"} <= loaded_by("import numpy, starlette")


def test_importing_webmap_loads_no_heavy_package() -> None:
    assert not loaded_by("import webmap") & (HEAVY | {"websockets", "msgspec"})


@pytest.mark.parametrize(
    "module", ["webmap.gate.__main__", "webmap.gate.display.client"]
)
def test_the_gate_loads_no_heavy_package(module: str) -> None:
    assert not loaded_by(f"import {module}") & HEAVY


def test_the_motion_configuration_imports_nothing_of_the_display() -> None:
    loaded = modules_after("import webmap.config.motion")
    ours = {name for name in loaded if name.startswith("webmap.")}
    assert ours == {
        "webmap.base",
        "webmap.base.errors",
        "webmap.base.logs",
        "webmap.base.outside_text",
        "webmap.config",
        "webmap.config.checks",
        "webmap.config.motion",
        "webmap.config.reading",
        "webmap.ros",
        "webmap.ros.names",
    }
    heavy = HEAVY | {"tomllib", "websockets"}
    assert not {name.partition(".")[0] for name in loaded} & heavy


def test_parsing_a_scan_in_the_gate_loads_cbor2_as_the_only_heavy_package() -> None:
    loaded = loaded_by(
        "import webmap.gate.__main__, cbor2\n"
        "from webmap.gate.lanes.odometry import parse_scan\n"
        "fields = ('angle_min', 'angle_increment', 'range_min', 'range_max')\n"
        "scan = dict.fromkeys(fields, 1.0)\n"
        "scan['ranges'] = cbor2.CBORTag(85, bytes(8))\n"
        "frame = cbor2.dumps({'op': 'publish', 'topic': '/s', 'msg': scan})\n"
        "assert parse_scan(frame, 0.0)[1].ranges == [0.0, 0.0]\n"
    )
    assert loaded & HEAVY == {"cbor2"}


def test_the_gate_process_imports_no_module_of_the_display() -> None:
    loaded = modules_after("import webmap.gate.__main__")
    folders = {".".join(name.split(".")[:2]) for name in loaded}
    display = {"cli", "console", "core", "modules", "scene", "server", "sim", "wire"}
    assert not folders & {f"webmap.{folder}" for folder in display}
