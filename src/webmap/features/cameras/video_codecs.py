"""The heads of video packets, by codec: where a decoder can start, and with what.

No I/O, and no picture is decoded. A packet has one picture.
"""

from typing import NamedTuple

from webmap.base.errors import ProtocolError

MOST_UNITS = 512
"""Most units of a packet."""

START = b"\0\0\1"


class Bits:
    """Reads numbers of any length from bytes, the highest bit first.

    Args:
        data: The bytes; keep them few, because they are one large number.
    """

    def __init__(self, data: bytes) -> None:
        self._value = int.from_bytes(data, "big")
        self._left = 8 * len(data)

    def take(self, count: int) -> int:
        """Return the number in the next ``count`` bits.

        Raises:
            ProtocolError: If there are fewer.
        """
        self._left -= count
        if self._left < 0:
            raise ProtocolError("a video packet that ends too early")
        return self._value >> self._left & (1 << count) - 1

    def golomb(self) -> int:
        """Return the next number in the code ``ue(v)`` of H.264.

        Raises:
            ProtocolError: If it has more than 32 bits, or the data ends before.
        """
        zeros = 0
        while not self.take(1):
            zeros += 1
            if zeros > 32:
                raise ProtocolError("a video packet with a number of more than 32 bits")
        return (1 << zeros) - 1 + self.take(zeros)


def nal_units(data: bytes) -> list[tuple[int, int]]:
    """Return begin and end of each NAL unit of a packet in Annex B form.

    Raises:
        ProtocolError: If the packet does not begin with a start code, has too many
            units, or an empty one.
    """
    begin = data.find(START)
    if begin < 0 or data[:begin].strip(b"\0"):
        raise ProtocolError(
            "a video packet that does not begin with a start code: the encoder must "
            "write Annex B"
        )
    units: list[tuple[int, int]] = []
    for _ in range(MOST_UNITS):
        begin += len(START)
        following = data.find(START, begin)
        end = len(data) if following < 0 else following
        if end == begin:
            raise ProtocolError("a video packet with an empty NAL unit")
        units.append((begin, end))
        if following < 0:
            return units
        begin = following
    raise ProtocolError(f"a video packet with more than {MOST_UNITS} NAL units")


def unescaped(unit: bytes) -> bytes:
    """Return a NAL unit without the bytes that prevent start codes in it."""
    return unit.replace(b"\0\0\3", b"\0\0")


class VideoConfig(NamedTuple):
    """What a decoder needs before a key picture."""

    codec: str
    """As in RFC 6381, for the browser."""

    width: int
    """In pixels, before cropping."""

    height: int


class Picture(NamedTuple):
    """The head of a packet that has a picture."""

    data: bytes
    """The packet; a key picture with its parameters."""

    config: VideoConfig | None
    """Of a key picture, None of all others."""

    follows: bool = True
    """Whether the picture before it came, as far as the codec shows that."""

    is_late: bool = False
    """Whether it refers to a later picture."""


class Sps(NamedTuple):
    """The parts of a sequence parameter set of H.264 that are used."""

    config: VideoConfig
    frame_bits: int
    """Bits of ``frame_num``, which counts the pictures that others refer to."""

    has_gaps: bool
    """Whether the encoder may leave out numbers."""

    has_planes: bool
    """Whether the planes of colours are coded separately."""


WITH_CHROMA = {44, 83, 86, 100, 110, 118, 122, 128, 134, 135, 138, 139, 244}
"""The profiles whose parameters describe the colours."""

MOST_READ = 512
"""Most bytes of a parameter set that are read: each read takes time for all of them."""

MOST_PARAMETERS = 16 << 10
"""Most bytes of the parameters of a video that are kept."""

TOO_LONG = f"a video with more than {MOST_PARAMETERS} bytes of parameters (SPS and PPS)"


def read_sps(unit: bytes) -> Sps:
    """Return what a sequence parameter set of H.264 states.

    Raises:
        ProtocolError: If it is not valid.
    """
    profile, constraints, level = unit[1:4].ljust(3, b"\0")
    bits = Bits(unescaped(unit[4 : 4 + MOST_READ]))
    bits.golomb()
    has_planes = 0
    if profile in WITH_CHROMA:
        chroma = bits.golomb()
        has_planes = bits.take(1) if chroma == 3 else 0
        bits.golomb()
        bits.golomb()
        bits.take(1)
        if bits.take(1):
            for number in range(12 if chroma == 3 else 8):
                if bits.take(1):
                    _skip_scaling(bits, 16 if number < 6 else 64)
    frame_bits = 4 + bits.golomb()
    order = bits.golomb()
    if order == 0:
        bits.golomb()
    elif order == 1:
        bits.take(1)
        for _ in range(2):
            bits.golomb()
        for _ in range(bits.golomb()):
            bits.golomb()
    bits.golomb()
    has_gaps = bits.take(1)
    width, rows = 16 * (1 + bits.golomb()), 16 * (1 + bits.golomb())
    height = rows * (2 - bits.take(1))
    if frame_bits > 16:
        raise ProtocolError("a video whose parameters (SPS) are not valid")
    codec = f"avc1.{profile:02x}{constraints:02x}{level:02x}"
    config = VideoConfig(codec, width, height)
    return Sps(config, frame_bits, bool(has_gaps), bool(has_planes))


def _skip_scaling(bits: Bits, size: int) -> None:
    scale = 8
    for _ in range(size):
        code = bits.golomb()
        scale = (scale + ((code + 1) // 2 if code % 2 else -(code // 2))) % 256
        if scale == 0:
            return


class H264:
    """Reads H.264 in Annex B form, and keeps the newest parameters."""

    def __init__(self) -> None:
        self._sps: dict[int, tuple[bytes, Sps]] = {}
        self._pps: dict[int, tuple[bytes, int]] = {}
        self._last = 0
        """The number of the last picture that others refer to."""

    def read(self, data: bytes) -> Picture | None:
        """Return the picture in a packet; None if it has parameters only.

        Raises:
            ProtocolError: If the packet is not valid.
        """
        own: set[tuple[int, int]] = set()
        first: bytes | None = None
        for begin, end in nal_units(data):
            type = data[begin] & 31
            if type in (7, 8):
                own.add((type, self._keep(type, data[begin:end])))
            elif type in (1, 5) and first is None:
                first = data[begin : min(end, begin + 40)]
            elif type == 2:
                raise ProtocolError("a video of H.264 with data partitions")
        return None if first is None else self._picture(data, first, own)

    def _keep(self, type: int, unit: bytes) -> int:
        if type == 7:
            number = Bits(unescaped(unit[4:20])).golomb()
            self._sps[number] = unit, read_sps(unit)
        else:
            bits = Bits(unescaped(unit[1:20]))
            number = bits.golomb()
            self._pps[number] = unit, bits.golomb()
        kept = (*self._sps.values(), *self._pps.values())
        if sum(len(unit) for unit, _ in kept) > MOST_PARAMETERS:
            self._sps.clear()
            self._pps.clear()
            raise ProtocolError(TOO_LONG)
        return number

    def _picture(self, data: bytes, slice: bytes, own: set[tuple[int, int]]) -> Picture:
        is_key = slice[0] & 31 == 5
        bits = Bits(unescaped(slice[1:]))
        first, kind, pps = bits.golomb(), bits.golomb(), bits.golomb()
        if first:
            raise ProtocolError(
                "a video packet with a part of a picture: each message must have one "
                "whole picture"
            )
        _, sps = self._sps.get(self._pps.get(pps, (b"", -1))[1], (b"", None))
        if sps is None:
            if not is_key:
                return Picture(data, None)
            raise ProtocolError(
                "a key picture (IDR) of H.264 without SPS and PPS: let the encoder "
                "repeat them in front of each key picture"
            )
        bits.take(2 if sps.has_planes else 0)
        number = bits.take(sps.frame_bits)
        follows = sps.has_gaps or (number - self._last) % (1 << sps.frame_bits) <= 1
        if is_key or slice[0] & 96:  # others refer to it
            self._last = 0 if is_key else number
        if not is_key:
            return Picture(data, None, follows, is_late=kind % 5 == 1)
        missing = [
            START + unit
            for type, kept in ((7, self._sps), (8, self._pps))
            for id, (unit, _) in kept.items()
            if (type, id) not in own
        ]
        return Picture(b"".join((*missing, data)), sps.config)


class Vp9:
    """Reads VP9, one picture in each packet; a lost message is not noticed."""

    def read(self, data: bytes) -> Picture | None:
        """Return the picture in a packet.

        Raises:
            ProtocolError: If the packet is not valid.
        """
        bits = Bits(data[:32])
        if bits.take(2) != 2:
            raise ProtocolError("a video packet that is not VP9")
        profile = bits.take(1) + 2 * bits.take(1)
        if profile == 3:
            bits.take(1)
        if bits.take(1) or bits.take(1):  # shows an earlier picture, or refers to one
            return Picture(data, None)
        bits.take(2)
        if bits.take(24) != 0x498342:
            raise ProtocolError("a key picture that is not VP9")
        depth = 8 if profile < 2 else 12 if bits.take(1) else 10
        if bits.take(3) != 7:  # not RGB
            bits.take(1 if profile in (0, 2) else 4)
        elif profile in (1, 3):
            bits.take(1)
        width, height = 1 + bits.take(16), 1 + bits.take(16)
        return Picture(
            data, VideoConfig(f"vp09.{profile:02}.51.{depth:02}", width, height)
        )
