"""The modules that an import loads: they affect the start time and what can fail."""

import graphlib
import subprocess
import sys
import tomllib
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent
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


def test_opening_the_console_loads_neither_the_check_of_bridges_nor_scan_assist():
    loaded = modules_after("import webmap.console, webmap.server.runner")
    later = ("webmap.discovery.doctor.", "webmap.gate.rules.assist")
    assert not [name for name in loaded if name.startswith(later)]


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
        "webmap.base.outline",
        "webmap.base.logs",
        "webmap.base.text",
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
        "from webmap.gate.lanes.scans import parse_scan\n"
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


def refuse_circles(package: str) -> None:
    """Raise CycleError, with the modules, if any import each other in a circle."""
    graph = grimp.build_graph(package, cache_dir=None)
    imports = {
        each: graph.find_modules_directly_imported_by(each) for each in graph.modules
    }
    graphlib.TopologicalSorter(imports).prepare()


def test_no_modules_import_each_other_in_a_circle() -> None:
    refuse_circles("webmap")


ANNOTATIONS = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    "
CIRCLES = {
    "two modules": ("one", "import NAME.two", "two", "import NAME.one"),
    "annotations": ("one", "import NAME.two", "two", f"{ANNOTATIONS}import NAME.one"),
    "a function": ("one", "import NAME.two", "two", "def f():\n    import NAME.one"),
    "a folder": ("in/one", "import NAME.in_.two", "in/two", "import NAME.in_.one"),
    "its init": ("in/__init__", "import NAME.in_.one", "in/one", "import NAME.in_"),
}


@pytest.mark.parametrize("circle", CIRCLES)
def test_a_circle_of_imports_is_refused(circle, tmp_path, monkeypatch) -> None:
    name = f"package_{circle.replace(' ', '_')}"
    (tmp_path / name / "in_").mkdir(parents=True)
    for folder in (tmp_path / name, tmp_path / name / "in_"):
        (folder / "__init__.py").touch()
    files = CIRCLES[circle]
    for file, text in zip(files[::2], files[1::2], strict=True):
        at = tmp_path / name / f"{file.replace('in/', 'in_/')}.py"
        at.write_text(text.replace("NAME", name), "utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(graphlib.CycleError):
        refuse_circles(name)
    if circle != "its init":  # the contract compares the files of a folder only
        contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
        every = contracts["tool"]["importlinter"]["contracts"]
        (own,) = [each for each in every if each["type"] == "acyclic_siblings"]
        assert own.keys() == {"name", "type", "ancestors"}  # without exceptions
        (tmp_path / "contract.toml").write_text(
            f'[tool.importlinter]\nroot_package = "{name}"\n'
            "[[tool.importlinter.contracts]]\n"
            f'name = "x"\ntype = "{own["type"]}"\nancestors = ["{name}"]\n'
        )
        done = subprocess.run(
            [BIN / "lint-imports", "--no-cache", "--config", "contract.toml"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 1
        assert "No cycles are allowed" in done.stdout
