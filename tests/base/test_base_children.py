"""Child processes: what they import, and when they end."""

import ast
import asyncio
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

import webmap
from equipment.bag_files import ODOMETRY, Made
from webmap.base.processes import python_command
from webmap.cli.demo import simulator
from webmap.cli.play import replay
from webmap.gate.display.supervisor import GateProcess
from webmap.gate.protocol import Ready
from webmap.ros.offload import Offload
from webmap.ros.rosbridge.events import Publish

pytestmark = pytest.mark.slow

SOURCE = Path(webmap.__file__).parent

HOSTILE = """\
from pathlib import Path
Path(__file__).with_suffix(".ran").touch()
raise ImportError("this file lies in the working folder")
"""


@pytest.fixture
def hostile(tmp_path, monkeypatch):
    """A working folder with files that are named like modules."""
    for name in ("msgspec", "json", "numpy", "websockets", "click", "rosbags"):
        (tmp_path / f"{name}.py").write_text(HOSTILE)
    (tmp_path / "webmap").mkdir()
    (tmp_path / "webmap" / "__init__.py").write_text(HOSTILE)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    assert [str(ran) for ran in tmp_path.rglob("*.ran")] == []


@pytest.fixture
def bag(tmp_path):
    made = Made("ros1")
    return made.bag(
        tmp_path / "office.bag", ("/odom", ODOMETRY, 0.0, made.odometry(0.0, 1.5))
    )


def gone(process):
    """Wait until a process that is not a child of this process has ended."""
    _, alive = psutil.wait_procs([process], timeout=15)
    return not [one for one in alive if one.status() != psutil.STATUS_ZOMBIE]


def decode_large():
    """Return a large message, decoded in another process."""
    frame = b'{"op":"publish","topic":"/log","msg":{"data":"%s"}}' % (b"x" * (1 << 20))
    message = Publish("/log", frame)

    async def decode():
        offload, done = Offload(), asyncio.Event()
        offload.decode(message, frozenset({None}), lambda _: done.set())
        await asyncio.wait_for(done.wait(), 60)
        await offload.stop()

    asyncio.run(decode())
    return message.decode(None)


def test_the_decoder_imports_nothing_from_the_working_folder(hostile):
    assert len(decode_large()["data"]) == 1 << 20


def test_the_gate_imports_nothing_from_the_working_folder(hostile):
    received = []
    child = GateProcess(
        lambda child, message: received.append(message), lambda child: None
    )
    child.start()
    child.stop(15.0)
    assert isinstance(received[0], Ready)


def test_the_simulator_of_a_demo_imports_nothing_from_the_working_folder(hostile):
    with simulator("--robots", 1, "--port", 0) as url:
        assert url.startswith("ws://")


def test_a_replay_imports_nothing_from_the_working_folder(bag, hostile):
    with replay("--", bag) as (url, _):
        assert url.startswith("ws://")


def test_only_one_module_of_the_package_uses_sys_executable():
    places = [
        file.relative_to(SOURCE).as_posix()
        for file in SOURCE.rglob("*.py")
        if "executable" in (text := file.read_text("utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Attribute) and node.attr == "executable"
    ]
    assert places == ["base/processes.py"]


def test_a_script_imports_modules_of_its_folder_but_its_children_do_not(tmp_path):
    (tmp_path / "own.py").write_text("WORD = 'mine'\n")
    script = tmp_path / "first.py"
    script.write_text(
        "import own, subprocess\n"
        "from webmap.base.processes import python_command\n"
        "done = subprocess.run(python_command('own'), stderr=subprocess.PIPE)\n"
        "print(own.WORD, b'No module named own' in done.stderr, flush=True)\n"
        "raise SystemExit\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "webmap", "run", str(script), "--no-browser"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.stdout == "mine True\n", done.stderr


HANGS = """\
import sys, time
import webmap.bags.__main__ as replay
replay.Recording = lambda *given, **named: time.sleep(600)
sys.argv = ["webmap.bags", "--with-parent", "office.bag"]
print("opens", flush=True)
replay.main()
"""


def test_a_hanging_replay_ends_with_its_parent():
    with subprocess.Popen(
        [sys.executable, "-P", "-c", HANGS],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:
        try:
            assert process.stdout.readline() == b"opens\n"
            process.stdin.close()  # as the system does when the parent is killed
            assert process.wait(15) == 1
        finally:
            process.kill()


PARENT = """\
import asyncio, time
from webmap.ros.rosbridge.events import Publish
from webmap.ros.offload import Offload
async def main():
    frame = b'{"op":"publish","topic":"/a","msg":{"data":"%s"}}' % (b"x" * (1 << 20))
    decoded = asyncio.Event()
    Offload().decode(Publish("/a", frame), frozenset({None}), lambda _: decoded.set())
    await decoded.wait()
    print("ready", flush=True)
    await asyncio.sleep(600)
asyncio.run(main())
"""


@pytest.mark.parametrize("parent", ["decoder", "play"])
def test_the_children_of_a_killed_parent_end(parent, bag):
    command = [sys.executable, "-P", "-c", PARENT]
    if parent == "play":
        command = python_command(
            "webmap", "play", bag, "--loop", "--no-browser", "--port", 0
        )
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as process:
        try:
            assert b"ready" in process.stdout.readline()
            children = psutil.Process(process.pid).children(recursive=True)
            assert children
        finally:
            process.kill()
    assert all(map(gone, children))


def test_a_child_receives_input_before_its_parent_ends() -> None:
    program = (
        "from webmap.base.processes import end_with_parent; import time\n"
        "print_it = lambda data: print(data.decode(), flush=True)\n"
        "end_with_parent(lambda: None, print_it, 0.0)\n"
        "time.sleep(60)"
    )
    child = subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert child.stdin
    assert child.stdout
    child.stdin.write(b"x")
    child.stdin.flush()
    assert child.stdout.readline() == b"x\n"
    child.stdin.close()
    assert child.wait(30) == 1
    child.stdout.close()
