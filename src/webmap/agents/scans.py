"""Laser scans as they cross the uplink: rounded, and with fewer beams. No I/O."""

import math
from typing import Any

import msgspec

from webmap.base.errors import ProtocolError, WireError
from webmap.ros.rosbridge.cbor import decode, looks_like_cbor

FLOAT32 = 85
"""The tag of an array of little-endian floats in CBOR."""


STEPS = 1024
"""Steps of a metre to which distances are rounded: a third of the bytes is noise."""


def lean_scan(frame: bytes | bytearray, beams: int | None) -> bytes | bytearray:
    """Return the frame of a ``sensor_msgs/LaserScan`` that needs fewer bytes.

    Distances in CBOR are rounded to 1/1024 m. If there are too many beams, each group
    of neighbouring beams becomes one beam in their middle, with the shortest of their
    valid distances, so that no obstacle is left out; intensities are.

    Args:
        frame: The operation ``publish``, as JSON or CBOR.
        beams: The greatest number of beams, if there is one.

    Returns:
        The new frame, of the same kind; ``frame`` itself if nothing changes.

    Raises:
        WireError: If the message is no scan.

    """
    is_cbor = looks_like_cbor(frame)
    if beams is None and not is_cbor:
        return frame
    try:
        operation = decode(frame) if is_cbor else msgspec.json.decode(frame)
        scan = operation["msg"]
        count = len(scan["ranges"])
        if beams is not None and count > beams:
            _thin(scan, math.ceil(count / beams))
        elif not is_cbor:
            return frame
        return _packed(operation, scan) if is_cbor else msgspec.json.encode(operation)
    except (ProtocolError, ValueError, KeyError, TypeError) as error:
        raise WireError(f"got a message that is no scan: {error!r}") from error


def _packed(operation: dict[str, Any], scan: dict[str, Any]) -> bytes:
    """Return the operation with a scan in CBOR, with rounded distances."""
    import cbor2
    import numpy as np

    for name in ("ranges", "intensities"):
        numbers = np.asarray(scan[name], dtype=float)
        if name == "ranges":
            numbers = np.round(numbers * STEPS) / STEPS
        scan[name] = cbor2.CBORTag(FLOAT32, numbers.astype("<f4").tobytes())
    packed: bytes = cbor2.dumps(operation)
    return packed


def _thin(scan: dict[str, Any], size: int) -> None:
    """Make one beam of each group of ``size`` beams."""
    least, step, first = (
        float(scan[name]) for name in ("range_min", "angle_increment", "angle_min")
    )
    ranges = _shortest(scan["ranges"], size, least)
    middle = first + (size - 1) / 2 * step
    scan |= {
        "angle_min": middle,
        "angle_max": middle + (len(ranges) - 1) * size * step,
        "angle_increment": size * step,
        "time_increment": size * float(scan.get("time_increment") or 0.0),
        "ranges": ranges.tolist(),
        "intensities": [],
    }


def _shortest(ranges: Any, size: int, least: float) -> Any:
    """Return the shortest valid distance of each group of beams; infinite without one.

    Args:
        ranges: The distances, in m; not a number or ``None`` if there is none.
        size: The number of beams in a group.
        least: The least valid distance, in m.

    """
    import numpy as np

    distances = np.asarray(ranges, dtype=float)
    distances = np.where(distances >= least, distances, np.inf)
    padded = np.full(math.ceil(len(distances) / size) * size, np.inf)
    padded[: len(distances)] = distances
    return padded.reshape(-1, size).min(axis=1)
