"""The bytes of a scan: the distances along its rays, as exactly as a page can show.

The layout after the element's id: ``f32 detail``, ``v total`` (rays of the scan), ``v
chosen`` (of them, evenly), ``v every``, ``f32 first``, ``f32 turn``, ``u8 form``; 6 f32
of the place if the form has :data:`PLACED`, 3 f32 of the motion if it has
:data:`MOVED`. Of each ``every`` chosen rays, the nearest hit is sent as that of the
first of them.

Then come ``v misses`` and, if there are any, the number of hits before each; then, if
there are hits, ``u8 order``, ``v base`` and the differences between each distance, in
units of the detail, and what is expected: the base (order 0), the distance before (1),
or that and the difference before it (2). Each list of numbers is ``u8 bits`` and a Rice
code: the number without its last bits as that many zeros and a one, then those bits;
:data:`LONGEST` zeros and a one come before a number in :data:`WHOLE` bits.
"""

import struct
from typing import TYPE_CHECKING

import numpy as np

from webmap.base.geometry import Affine
from webmap.scene.live import Rays
from webmap.scene.wire.opcodes import varint

if TYPE_CHECKING:
    from numpy.typing import NDArray

PLACED, MOVED = 1, 2
"""Flags of the form."""

LONGEST = 12
"""Zeros before a number that is written as a whole."""

WHOLE = 18
"""Bits of a whole number: room for twice the difference of differences of distances."""

MOST = 32767
"""The greatest distance in units of the detail."""

JUMP = 64
"""Units of the detail from which on a difference counts as a jump."""

NEAR = 4
"""Units of the detail, half a pixel at most, within which neighbouring rays are one."""

_HEAD = struct.Struct("<f").pack
_TURNS = struct.Struct("<ff").pack
_PLACE = struct.Struct("<6f").pack
_MOTION = struct.Struct("<3f").pack


def encode_rays(rays: Rays, detail: float) -> bytes:
    """Return the bytes of a scan.

    Args:
        rays: The scan.
        detail: Metres to which distances are rounded; more if they are too far.

    """
    reach = np.frombuffer(rays.ranges, "<f4").astype(np.float64)
    chosen = len(reach)
    hits = np.isfinite(reach) & (reach >= 0.0)
    reach[~hits] = np.nan
    farthest = float(reach[hits].max(initial=0.0))
    detail = max(detail, farthest / MOST)
    every = 1
    if chosen > 1 and farthest > 0.0:
        apart = farthest * abs(rays.turn) * rays.total / chosen
        every = max(1, int(min(chosen, NEAR * detail / max(apart, 1e-9))))
    if every > 1:
        # The nearest, so that a thin pole in front of a wall stays.
        reach = np.fmin.reduceat(reach, np.arange(0, chosen, every))
        hits = np.isfinite(reach)
    form = PLACED * (rays.place != Affine()) | MOVED * any(rays.moved)
    out = bytearray(_HEAD(detail)) + varint(rays.total) + varint(chosen)
    out += varint(every) + _TURNS(rays.first, rays.turn)
    out.append(form)
    if form & PLACED:
        out += _PLACE(*rays.place.values)
    if form & MOVED:
        out += _MOTION(*rays.moved)
    out += _missed(hits)
    if hits.any():
        # The detail as the page reads it, so that both round alike.
        unit = float(np.float32(detail))
        out += _distances(np.rint(reach[hits] / unit).astype(np.int64))
    return bytes(out)


def _missed(hits: "NDArray[np.bool_]") -> bytes:
    """Return the rays that hit nothing, as the number of hits before each of them."""
    missed = np.flatnonzero(~hits)
    if not len(missed):
        return varint(0)
    return varint(len(missed)) + _rice(np.diff(missed, prepend=-1) - 1)


def _distances(found: "NDArray[np.int64]") -> bytes:
    """Return whole distances by the expectation that leaves the least to write."""
    mean = int(found.mean())
    slope, bend = np.zeros_like(found), np.zeros_like(found)
    np.subtract(found[1:], found[:-1], out=slope[1:])
    np.subtract(slope[1:], slope[:-1], out=bend[1:])
    left = (found - mean, slope, bend)
    # Jumps from one thing to another cost about the same, however far.
    costs = [int(np.minimum(abs(each), JUMP).sum()) for each in left]
    order = costs.index(min(costs))
    base = int(found[0]) if order else mean
    signed = left[order]
    return bytes((order,)) + varint(base) + _rice((signed << 1) ^ (signed >> 63))


def _rice(numbers: "NDArray[np.int64]") -> bytes:
    """Return numbers, none below 0, in a Rice code."""
    # For the usual distribution this is the best number of bits, or next to it.
    bits = max(0, int(np.partition(numbers, len(numbers) // 2)[len(numbers) // 2]))
    bits = max(0, bits.bit_length() - 1)
    zeros = numbers >> bits
    whole = zeros >= LONGEST
    zeros[whole] = LONGEST
    lengths = zeros + (bits + 1)
    lengths[whole] = LONGEST + 1 + WHOLE
    ends = lengths.cumsum()
    ones = ends - lengths + zeros
    out = np.zeros(ends[-1], np.uint8)
    few = ~whole
    _put(out, ones[few], numbers[few] & ((1 << bits) - 1) | (1 << bits), bits + 1)
    if len(few) > np.count_nonzero(few):
        _put(out, ones[whole], numbers[whole] | (1 << WHOLE), WHOLE + 1)
    return bytes((bits,)) + np.packbits(out).tobytes()


def _put(
    out: "NDArray[np.uint8]",
    at: "NDArray[np.int64]",
    numbers: "NDArray[np.int64]",
    bits: int,
) -> None:
    """Write numbers of as many bits from the given places on."""
    all_bits = np.unpackbits(numbers.astype(">u4").view(np.uint8)).reshape(-1, 32)
    out[at[:, np.newaxis] + np.arange(bits)] = all_bits[:, 32 - bits :]
