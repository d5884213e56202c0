"""MCAP files of foxglove-sdk, which foxglove_bridge and Foxglove's agent use."""

import json

import foxglove
from foxglove.mcap import MCAPCompression, MCAPWriteOptions

from equipment.bag_files import BEGIN, ODOMETRY, Made, types_of

NAMES = {"ros1": ODOMETRY, "ros2": "nav_msgs/msg/Odometry"}
LOOSE = {"use_chunks": False}
"""Options of a file without chunks."""

__all__ = ["LOOSE", "MCAPCompression", "definition", "odometry", "write"]


def write(path, *messages, profile=None, **options):
    """Write messages: a topic, encodings, type, definition, moment and bytes each."""
    context, channels = foxglove.Context(), {}
    options = MCAPWriteOptions(profile=profile, **options)
    with foxglove.open_mcap(path, context=context, writer_options=options):
        for topic, (encoding, schema), name, text, moment, data in messages:
            if topic not in channels:
                channels[topic] = foxglove.Channel(
                    topic,
                    schema=foxglove.Schema(name=name, encoding=schema, data=text),
                    message_encoding=encoding,
                    context=context,
                )
            channels[topic].log(data, log_time=BEGIN + round(moment * 1e9))
    return path


def definition(dialect):
    """Return the definition of odometry with those of its parts, as in a file."""
    version = next(types_of(dialect).versions(ODOMETRY))
    release = 1 if dialect == "ros1" else 2
    text, _ = version.store.generate_msgdef(version.type_name, ros_version=release)
    return text.encode()


def odometry(moment, x, *, dialect="ros2", encoding=None, topic="/odom"):
    """Return one message of :func:`write`: odometry."""
    message = Made(dialect).odometry(moment, x)
    data = next(types_of(dialect).versions(ODOMETRY)).bytes_of(message)
    if encoding == "json":
        data = json.dumps(message, default=list).encode()
    encodings = encoding or {"ros1": "ros1", "ros2": "cdr"}[dialect], f"{dialect}msg"
    return topic, encodings, NAMES[dialect], definition(dialect), moment, data
