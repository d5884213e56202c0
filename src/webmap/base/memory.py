"""How the process gets memory for what is large, such as the cells of a map."""

import ctypes
import platform

LARGE = 4 * 2**20
"""Bytes from which a piece of memory goes back to the system when it is freed."""

_M_MMAP_THRESHOLD = -3


def return_large_pieces() -> None:
    """Have every large piece of memory go back to the system as soon as it is freed.

    glibc raises the size from which it does so to that of the largest piece that was
    freed, up to 32 MiB. What is smaller comes from a heap that shrinks at its end only:
    one small thing behind a map that went keeps the room of the map. Setting the size
    ends the raising (see ``mallopt(3)``). Other C libraries are left as they are.
    """
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, LARGE)
