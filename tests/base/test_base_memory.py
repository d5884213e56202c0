"""The memory of a map is returned even if small objects were allocated after it."""

import platform
import subprocess
import sys

import pytest

LEFT_BEHIND = """
import psutil
from webmap.base.processes import return_large_pieces

if {returning}:
    return_large_pieces()
before = psutil.Process().memory_info().rss
del (first := [bytearray(20 << 20)])[:]  # from here on glibc keeps what is smaller
map_, small = bytearray(b"1") * (16 << 20), bytearray(1000)
del map_
print(psutil.Process().memory_info().rss - before)
"""


def left_behind(*, returning: bool) -> int:
    """Return the bytes that a process holds after it made and deleted a 16 MiB map."""
    program = LEFT_BEHIND.format(returning=returning)
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    return int(done.stdout)


@pytest.mark.skipif(
    platform.libc_ver()[0] != "glibc", reason="only glibc keeps the memory"
)
def test_the_memory_of_a_deleted_map_is_returned_to_the_system():
    assert left_behind(returning=False) > 15 << 20, (
        "glibc keeps the memory without the measure"
    )
    assert left_behind(returning=True) < 2 << 20
