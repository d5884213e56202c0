"""Memory allocation for large data, such as the cells of a map."""

import ctypes
import platform

LARGE = 4 * 2**20
"""Bytes from which a block of memory is returned to the system when it is freed."""

_M_MMAP_THRESHOLD = -3


def return_large_pieces() -> None:
    """Return every large block of memory to the system as soon as it is freed.

    By default glibc raises the limit for this to the size of the largest block that was
    freed, up to 32 MiB. Smaller blocks come from a heap that shrinks only at its end:
    one small block behind a freed map keeps the memory of the map. Setting the limit
    ends the raising (see ``mallopt(3)``). Other C libraries are not changed.
    """
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, LARGE)
