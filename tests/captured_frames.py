"""Frames that were captured from real rosbridge servers: where they are.

The folder ``captured`` holds them once, as its README says. A frame has a plain name
here, such as ``publish_odom.json``; its file also names what wrote it.
"""

from pathlib import Path

CAPTURED = Path(__file__).parent / "captured"

PLAYER = {"module": "frame_player", "cwd": Path(__file__).parent}
"""How the player of frames is started as a process: with ``-m``, in that folder."""

_WRITER = {"ros1": "ujson", "ros2": "ros2"}

_PLAYED = (
    "cbor_battery_nan.bin",
    "cbor_map.bin",
    "cbor_scan_inf_nan.bin",
    "cbor_tf.bin",
    "cborraw_odom.bin",
    "cborraw_scan_inf_nan.bin",
    "publish_amcl_pose.json",
    "publish_battery_nan.json",
    "publish_map.json",
    "publish_odom.json",
    "publish_scan_inf_nan.json",
    "publish_tf.json",
    "publish_tf_static.json",
    "service_response_rosapi_get_time.json",
    "service_response_rosapi_nodes.json",
    "service_response_rosapi_services.json",
    "service_response_rosapi_topics.json",
    "service_response_stop_trigger.json",
)


def frame_file(dialect: str, name: str) -> Path:
    """Return the file of a frame.

    Args:
        dialect: The server's, ``"ros1"`` or ``"ros2"``.
        name: The frame's plain name.

    """
    stem, _, suffix = name.rpartition(".")
    if suffix != "bin":
        name = f"{stem}.{_WRITER[dialect]}.{suffix}"
    path = CAPTURED / dialect / name
    assert path.is_file(), path
    return path


def played(dialect: str) -> list[Path]:
    """Return what ``frame_player`` plays to be the server of a dialect."""
    return [frame_file(dialect, name) for name in _PLAYED]
