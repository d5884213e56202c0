"""Checks whether frames lead from the map to a robot; without I/O."""

from webmap.base.errors import ProtocolError
from webmap.discovery.tf_robots import MAP
from webmap.ros.messages import TFMessage
from webmap.ros.received_message import ReceivedMessage
from webmap.ros.tf import Buffer, Transform, TransformError


class FrameListening:
    """Collects the messages on the topics with frames, of all namespaces."""

    def __init__(self) -> None:
        self._buffers: dict[str, Buffer] = {}
        self._refused: dict[str, list[str]] = {}

    def received(self, message: ReceivedMessage) -> None:
        """Process a message of ``tf`` or ``tf_static``."""
        namespace, _, name = message.topic.rpartition("/")
        buffer = self._buffers.setdefault(namespace, Buffer())
        refused = self._refused.setdefault(namespace, [])
        try:
            transforms = message.decode(TFMessage).transforms
        except ProtocolError as error:
            refused.append(f"{message.topic} cannot be read: {error}")
            return
        for each in transforms:
            move = each.transform
            try:
                buffer.add(
                    each.frame_id,
                    each.child_frame_id,
                    Transform(move.translation.vector, move.rotation.as_sent),
                    each.stamp,
                    static=name == "tf_static",
                    namespace=namespace,
                )
            except (TransformError, ProtocolError) as error:
                refused.append(str(error))

    def oddities(self, namespace: str) -> tuple[str, ...]:
        """Return the oddities in the frames of a namespace, each once."""
        buffer = self._buffers.get(namespace)
        notes = [] if buffer is None else list(buffer.notes)
        return tuple(dict.fromkeys([*self._refused.get(namespace, ()), *notes]))

    def missing(self, namespace: str, frame: str, start: str = MAP) -> str:
        """Return why no transform leads from one frame to another; empty if one does.

        Args:
            namespace: Namespace of the topic with the frames.
            frame: The frame at the end.
            start: The frame at the start.

        """
        buffer = self._buffers.get(namespace)
        if buffer is None:
            return f"no message was received on {namespace}/tf"
        name, start = buffer.name(frame, namespace), buffer.name(start, namespace)
        if name == start:
            return ""
        try:
            buffer.lookup(start, name)
        except TransformError as error:
            return str(error)
        return ""
