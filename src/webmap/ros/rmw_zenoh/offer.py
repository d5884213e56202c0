"""What the nodes of rmw_zenoh announce and send, as frames of a Foxglove server.

A node announces a publisher of ``/odom`` with a liveliness token, which is a key such
as ``@ros2_lv/0/ID/0/10/MP/%/%/robot/%odom/TYPE/HASH/QOS``; ``docs/design.md`` of
rmw_zenoh describes its parts.
"""

import itertools
import re
from collections import deque
from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

from webmap.base.errors import ProtocolError
from webmap.base.text import one_line
from webmap.ros.foxglove.messages import TYPE_HASH
from webmap.ros.foxglove.protocol import (
    MESSAGE_DATA,
    PAYLOAD,
    Channel,
    advertise,
    operation,
    unadvertise,
)
from webmap.ros.foxglove.session import ERROR, MOST_STATUSES
from webmap.ros.names import is_topic, normalise_topic
from webmap.ros.sockets.frame_reader import SHORTENED

ROOT = "@ros2_lv"
"""The first part of each token."""

MOST_ENDPOINTS = 20_000
"""Most publishers and subscribers of one domain; others are left out."""

TOO_MANY = (
    f"got more than {MOST_ENDPOINTS} publishers and subscribers; the others are left "
    "out"
)

MOST_TOKEN = 1_200
"""Most characters of a token; those of ROS are shorter, as names are."""

INTRODUCTION = operation("serverInfo")
"""The first frame: nothing but topics is offered."""

_KINDS = ("MP", "MS")
_OTHER_KINDS = ("NN", "SS", "SC")
"""Kinds of tokens: publishers and subscribers; nodes, services and clients."""

_PARTS = 13
"""Parts of the token of a publisher or a subscriber."""

_LATCHED = "1"
"""Transient local, in the second part of a token's quality of service."""

_TYPE = re.compile(r"([A-Za-z]\w*)::(msg|srv|action)::dds_::([A-Za-z]\w*)_", re.ASCII)

_STAMP = slice(8, 16)
"""Where an attachment has the time of publishing, in nanoseconds."""

_ATTACHMENT = 33
"""Bytes of an attachment: number, time, and the publisher's 16 bytes with a length."""


class Source(NamedTuple):
    """What the publishers of one topic with equal definitions send."""

    topic: str
    type: str
    """The name of the type: ``nav_msgs/msg/Odometry``."""

    hash: str
    """The hash of the type's definition."""

    key: str
    """The part of the key of the messages after the domain."""

    latched: bool = False
    """Whether one of the publishers keeps its last messages for late subscribers."""


class Endpoint(NamedTuple):
    """A publisher or a subscriber of one node."""

    node: str
    publishes: bool
    latched: bool
    """Whether it keeps its last messages for late subscribers."""

    source: Source


Change: TypeAlias = tuple[str, Endpoint | ProtocolError | None]
"""A token, and what it announces now, or why it cannot be read."""


def read_token(token: str) -> Endpoint | None:
    """Return what a token announces; None for a node, a service or a client.

    Raises:
        ProtocolError: If the text is not a token of rmw_zenoh.

    """
    parts = token.split("/")
    is_one = len(parts) > 5 and parts[0] == ROOT and "*" not in token
    kind = parts[5] if is_one else ""
    if kind in _OTHER_KINDS:
        return None
    if kind in _KINDS and len(parts) >= _PARTS and len(token) <= MOST_TOKEN:
        space, node, name, type, hash, quality = parts[7:_PARTS]
        topic, match = name.replace("%", "/"), _TYPE.fullmatch(type)
        if match is not None and is_topic(topic) and topic == normalise_topic(topic):
            key = f"{topic.strip('/')}/{type}/{hash}"
            return Endpoint(
                f"{space.replace('%', '/').rstrip('/')}/{node.replace('%', '/')}",
                kind == "MP",
                quality.split(":")[1:2] == [_LATCHED],
                Source(topic, "/".join(match.groups()), hash, key),
            )
    raise ProtocolError(
        f"got the token {one_line(token, 300)}, which no rmw_zenoh makes"
    )


def change_of(token: str, *, came: bool) -> Change:
    """Return the change by a token that came or went; this never raises."""
    try:
        return token, read_token(token) if came else None
    except ProtocolError as error:
        return token, error


def error_status(text: str) -> bytes:
    """Return the status frame with an error for people."""
    return operation("status", level=ERROR, message=text)


def message_frame(
    subscription: int, topic: str, payload: bytes, size: int, attachment: bytes
) -> bytes:
    """Return the frame with a message, or with an error if it is not one of rmw_zenoh.

    Args:
        subscription: The subscription that the message is for.
        topic: Its topic.
        payload: The bytes of the node; empty if there are too many.
        size: How many bytes the node sent.
        attachment: What the node sent beside them.

    """
    if len(attachment) != _ATTACHMENT or attachment[16] != 16:
        return error_status(
            f"{topic}: got a message with an attachment of {len(attachment)} bytes, "
            f"expected {_ATTACHMENT}, as rmw_zenoh of ROS 2 Kilted sends: the sender "
            "is another program or an older rmw_zenoh"
        )
    kept = (
        b"" if len(payload) == size else SHORTENED + (size + PAYLOAD).to_bytes(8, "big")
    )
    head = bytes([MESSAGE_DATA]) + subscription.to_bytes(4, "little")
    return b"".join((kept, head, attachment[_STAMP], payload))


class Offer:
    """The topics of one domain, as a server offers them on one connection."""

    def __init__(self) -> None:
        self.channels: dict[int, Source] = {}
        self._endpoints: dict[str, Endpoint] = {}
        self._ids = itertools.count(1)

    def nodes(self, topic: str, *, publish: bool) -> list[str]:
        """Return the nodes that publish a topic, or that subscribe to it."""
        every = self._endpoints.values()
        found = (e for e in every if (e.source.topic, e.publishes) == (topic, publish))
        return sorted({each.node for each in found})

    def apply(self, changes: deque[Change]) -> Iterator[bytes]:
        """Remove the changes that came so far, and return the frames for them."""
        if not changes:
            return
        faults: dict[str, None] = {}
        for token, found in [changes.popleft() for _ in range(len(changes))]:
            if isinstance(found, ProtocolError):
                faults[str(found)] = None
            elif found is None:
                self._endpoints.pop(token, None)
            elif len(self._endpoints) < MOST_ENDPOINTS or token in self._endpoints:
                self._endpoints[token] = found
            else:
                faults[TOO_MANY] = None
        yield from map(error_status, itertools.islice(faults, MOST_STATUSES))
        yield from self._changed_channels()

    def _changed_channels(self) -> Iterator[bytes]:
        every = self._endpoints.values()
        published = {each.source.topic for each in every if each.publishes}
        kept = {each.source for each in every if each.publishes and each.latched}
        now = {
            each.source._replace(latched=each.source in kept): None
            for each in every
            if each.publishes or each.source.topic not in published
        }
        gone = [id for id, source in self.channels.items() if source not in now]
        for id in gone:
            del self.channels[id]
        known = set(self.channels.values())
        new = {next(self._ids): source for source in now if source not in known}
        self.channels |= new
        yield unadvertise(gone)
        yield advertise(
            Channel(id, each.topic, "cdr", each.type, each.hash, TYPE_HASH)
            for id, each in new.items()
        )
