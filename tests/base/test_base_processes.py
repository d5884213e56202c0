"""Child processes, ports that cannot be listened on, and the C library."""

import errno
import subprocess

import pytest

from webmap.base import processes


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (errno.EADDRINUSE, "port 80 on ::1 is in use"),
        (errno.EACCES, "port 80 on ::1 is not permitted"),
        (errno.EADDRNOTAVAIL, "::1 is not an address of this machine"),
        (errno.EIO, "cannot listen on ::1, port 80: broken"),
    ],
)
def test_a_port_that_cannot_be_listened_on_gives_one_sentence(number, text):
    error = OSError(number, "broken")
    assert processes.why_not_listening("::1", 80, error).startswith(text)


def test_a_child_process_ends_with_its_block():
    with processes.child_process("timeit", "-n", "1", "-r", "1", "pass") as child:
        assert "1 loop" in child.line
    assert child.process.returncode is not None


def test_a_child_process_that_does_not_end_is_killed(monkeypatch):
    killed = []

    def wait(process, timeout=None):
        if timeout is not None and not killed:
            raise subprocess.TimeoutExpired("python", timeout)
        return unpatched(process, timeout)

    def kill(process):
        killed.append(process)
        really_kill(process)

    unpatched, really_kill = subprocess.Popen.wait, subprocess.Popen.kill
    monkeypatch.setattr(subprocess.Popen, "wait", wait)
    monkeypatch.setattr(subprocess.Popen, "kill", kill)
    with processes.child_process("timeit", "-n", "1", "-r", "1", "pass") as child:
        pass
    assert killed == [child.process]


def test_another_c_library_is_left_as_it_is(monkeypatch):
    monkeypatch.setattr("platform.libc_ver", lambda: ("musl", "1.2"))
    monkeypatch.setattr("ctypes.CDLL", lambda name: pytest.fail("it was loaded"))
    processes.return_large_pieces()


def test_a_loaded_module_is_not_loaded_again():
    assert processes.load_soon("errno") is None
