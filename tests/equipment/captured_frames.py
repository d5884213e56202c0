"""The files of frames that were captured from real rosbridge servers.

They are in the folder ``captured``; see its README. A frame has a plain name here, such
as ``publish_odom.json``; the name of its file also contains the program that wrote it.
"""

from pathlib import Path

CAPTURED = Path(__file__).parents[1] / "captured"

PLAYER = {"module": "equipment.frame_player", "cwd": Path(__file__).parents[1]}
"""The module and the folder with which ``python -m`` starts the player of frames."""

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
        dialect: The dialect of the server, ``"ros1"`` or ``"ros2"``.
        name: The plain name of the frame.

    """
    stem, _, suffix = name.rpartition(".")
    if suffix != "bin":
        name = f"{stem}.{_WRITER[dialect]}.{suffix}"
    path = CAPTURED / dialect / name
    assert path.is_file(), path
    return path


def played(dialect: str) -> list[Path]:
    """Return the files with which ``frame_player`` acts as a server of a dialect."""
    return [frame_file(dialect, name) for name in _PLAYED]
