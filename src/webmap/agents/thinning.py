"""Laser scans with fewer beams, for a slow uplink. No I/O."""

import math
from typing import Any

import msgspec

from webmap.base.errors import ProtocolError, WireError
from webmap.ros.rosbridge.cbor import decode, looks_like_cbor

FLOAT32 = 85
"""The tag of an array of little-endian floats in CBOR."""


def thinned(frame: bytes | bytearray, beams: int) -> bytes | bytearray:
    """Return the frame of a ``sensor_msgs/LaserScan`` with fewer beams.

    Each group of neighbouring beams becomes one beam in their middle, with the shortest
    of their valid distances, so that no obstacle is left out. Intensities are.

    Args:
        frame: The operation ``publish``, as JSON or CBOR.
        beams: The greatest number of beams.

    Returns:
        The new frame, of the same kind; ``frame`` itself if it has few enough beams.

    Raises:
        WireError: If the message is no scan.

    """
    is_cbor = looks_like_cbor(frame)
    try:
        operation = decode(frame) if is_cbor else msgspec.json.decode(frame)
        scan = operation["msg"]
        least, step, first = (
            float(scan[name]) for name in ("range_min", "angle_increment", "angle_min")
        )
        count = len(scan["ranges"])
        if count <= beams:
            return frame
        size = math.ceil(count / beams)
        ranges = _shortest(scan["ranges"], size, least)
    except (ProtocolError, ValueError, KeyError, TypeError) as error:
        raise WireError(f"got a message that is no scan: {error!r}") from error
    scan |= {
        "angle_min": first + (size - 1) / 2 * step,
        "angle_max": first + (size - 1) / 2 * step + (len(ranges) - 1) * size * step,
        "angle_increment": size * step,
        "time_increment": size * float(scan.get("time_increment") or 0.0),
        "ranges": ranges.tolist(),
        "intensities": [],
    }
    if not is_cbor:
        return msgspec.json.encode(operation)
    import cbor2

    scan["ranges"] = cbor2.CBORTag(FLOAT32, ranges.astype("<f4").tobytes())
    packed: bytes = cbor2.dumps(operation)
    return packed


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
