"""What a camera on the web answers: a picture, or one after another. No I/O."""

from email.message import Message

from webmap.errors import ProtocolError
from webmap.ros.image_multipart import Multipart
from webmap.ros.messages_image import MAX_BYTES

MAX_HEAD = 16_384
"""The longest head of an answer, in bytes."""

_ENDS = (b"\r\n\r\n", b"\n\n")

_WORDS = {
    401: "it wants a user and a password; put them into the address, before the host",
    403: "it does not let us",
    404: "there is nothing at this address",
    503: "it has no picture now",
}


class Answer:
    """Takes an HTTP answer apart, whether it is a stream or a single picture."""

    def __init__(self) -> None:
        self.streams: bool | None = None
        """Whether pictures follow each other in it; None until its head has come."""
        self._head = bytearray()
        self._parts: Multipart | None = None
        self._body = bytearray()
        self._length: int | None = None

    def feed(self, data: bytes) -> list[bytes]:
        """Take in what came and return the pictures that are whole by it.

        Raises:
            ProtocolError: If it is not what a camera answers.

        """
        if self.streams is None:
            self._head += data
            found = [(self._head.find(end), len(end)) for end in _ENDS]
            ends = [(place, size) for place, size in found if place >= 0]
            if not ends:
                if len(self._head) > MAX_HEAD:
                    raise ProtocolError(
                        f"its answer begins with {MAX_HEAD} bytes of head"
                    )
                return []
            end, size = min(ends)
            data = bytes(self._head[end + size :])
            self._read_head(bytes(self._head[:end]))
        if self._parts is not None:
            return self._parts.feed(data)
        self._body += data
        if len(self._body) > MAX_BYTES:
            raise ProtocolError(f"a picture of more than {MAX_BYTES} bytes")
        if self._length is not None and len(self._body) >= self._length:
            return [self._take(self._length)]
        return []

    def end(self) -> list[bytes]:
        """Take in that the connection has ended; what it leaves may be a picture.

        Raises:
            ProtocolError: If it ended too early.

        """
        if self.streams is None:
            raise ProtocolError("it hung up without an answer")
        if self.streams or not self._body:
            return []
        if self._length is not None:
            raise ProtocolError("it hung up in the middle of a picture")
        return [self._take(len(self._body))]

    def _take(self, length: int) -> bytes:
        picture = bytes(self._body[:length])
        self._body.clear()
        return picture

    def _read_head(self, head: bytes) -> None:
        first, *lines = head.decode("latin-1").splitlines() or [""]
        words = first.split(None, 2)
        if (
            len(words) < 2
            or not words[0].startswith("HTTP/")
            or not words[1].isdecimal()
        ):
            raise ProtocolError("what answers there does not speak HTTP")
        status = int(words[1][:4])
        headers = {
            name.strip().lower(): value.strip()
            for name, _, value in (line.partition(":") for line in lines)
        }
        _check_status(status)
        kind = Message()
        kind["Content-Type"] = headers.get("content-type", "")
        media = kind.get_content_type() if headers.get("content-type") else "nothing"
        if media.startswith("multipart/"):
            self._parts = Multipart(str(kind.get_param("boundary") or ""))
        elif not media.startswith("image/"):
            raise ProtocolError(
                f"it answers with {_plain(media)}, expected pictures (image/jpeg, or "
                "multipart/x-mixed-replace); this must be the address of the pictures "
                "themselves, not that of a page that shows them"
            )
        if headers.get("transfer-encoding", "identity").lower() != "identity":
            raise ProtocolError("it answers in chunks, which were not asked for")
        length = headers.get("content-length", "")
        if self._parts is None and length.isdecimal() and len(length) < 12:
            self._length = int(length)
            if self._length > MAX_BYTES:
                raise ProtocolError(f"a picture of {length} bytes, {MAX_BYTES} at most")
        self.streams = self._parts is not None


def _check_status(status: int) -> None:
    if 300 <= status < 400:
        raise ProtocolError(
            f"it answers {status} and sends us elsewhere, which is not followed; give "
            "the address where the pictures are"
        )
    if status != 200:
        words = _WORDS.get(status, "200 was expected")
        raise ProtocolError(f"it answers {status}: {words}")


def _plain(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text[:60])
