"""What is odd in a scan that can be drawn all the same, in words."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from webmap.ros.messages import LaserScanMsg


def scan_doubt(scan: "LaserScanMsg") -> str | None:
    """Return what a person should know of a scan; None if it is as it should be.

    A scan all of whose readings are infinite is not odd: it is one of an empty field.
    """
    ranges = scan.ranges
    count = len(ranges)
    if not count:
        return "its scans have no ranges; expected one distance for each ray"
    # A number is itself, NaN is not; the first settles it for nearly every scan.
    if ranges[0] != ranges[0] and not (ranges == ranges).any():
        return (
            f"none of its {count} ranges is a number, all are null or NaN; expected "
            "metres, or infinity where nothing is"
        )
    return None
