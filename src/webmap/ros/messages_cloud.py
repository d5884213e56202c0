"""Typed views of clouds of points."""

import binascii
from array import array
from typing import TYPE_CHECKING, Any

import msgspec

from webmap.errors import ProtocolError
from webmap.ros.arrays import Numbers
from webmap.ros.messages import Stamped

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MAX_POINTS = 1 << 23
"""The most points that a cloud may have."""

# By the constants of sensor_msgs/PointField.
_FORMATS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


class Octets(Numbers):
    """Bytes of ``uint8[]``: JSON brings them in base64, or as a list of numbers."""

    typecode = "B"
    __slots__ = ()

    @classmethod
    def _numbers(cls, value: object) -> "array[Any]":
        if isinstance(value, str):
            try:
                value = binascii.a2b_base64(value)
            except binascii.Error as error:
                raise ValueError(f"it is not base64: {error}") from None
        return super()._numbers(value)

    def array(self) -> "NDArray[np.uint8]":
        """Return the bytes as a read-only array of shape (N,), not copied."""
        import numpy as np

        return np.frombuffer(memoryview(self.values).toreadonly(), np.uint8)


class PointFieldMsg(msgspec.Struct, frozen=True):
    """``sensor_msgs/PointField``: one number of each point."""

    name: str
    offset: int
    """Bytes from the point's beginning."""

    datatype: int
    """1 to 8: int8, uint8, int16, uint16, int32, uint32, float32, float64."""

    count: int = 1


class PointCloud2Msg(Stamped, frozen=True, kw_only=True):
    """``sensor_msgs/PointCloud2``."""

    height: int
    width: int
    fields: list[PointFieldMsg]
    point_step: int
    """Bytes a point."""

    row_step: int
    """Bytes a row; more than its points take, if rows are padded."""

    data: Octets
    is_bigendian: bool = False

    def columns(self, *names: str) -> "list[NDArray[np.float64]]":
        """Return fields of all points, each of shape (N,).

        Args:
            *names: The fields' names.

        Raises:
            ProtocolError: If there is no such field, or the sizes do not fit.

        """
        import numpy as np

        row_step = self._row_step
        self._check_sizes(row_step)
        order = ">" if self.is_bigendian else "<"
        formats, offsets = [], []
        for name in names:
            field = self._field(name)
            formats.append(order + _FORMATS[field.datatype])
            offsets.append(field.offset)
        try:
            layout = np.dtype(
                {
                    "names": list(names),
                    "formats": formats,
                    "offsets": offsets,
                    "itemsize": self.point_step,
                }
            )
        except (ValueError, OverflowError) as error:
            raise ProtocolError(
                f"the fields {', '.join(names)} do not fit into points of "
                f"{self.point_step} bytes: {error}"
            ) from None
        used = self.width * self.point_step
        rows = self.data.array()[: self.height * row_step]
        rows = rows.reshape(self.height, row_step)[:, :used]
        points = np.ascontiguousarray(rows).reshape(-1).view(layout)
        return [points[name].astype(np.float64) for name in names]

    def thinned(self, most: int) -> "PointCloud2Msg":
        """Return the cloud with ``most`` points at the most, evenly chosen, in one row.

        Raises:
            ProtocolError: If the sizes do not fit.

        """
        row_step = self._row_step
        self._check_sizes(row_step)
        if self.width * self.height <= most:
            return self
        used = self.width * self.point_step
        rows = self.data.array()[: self.height * row_step]
        rows = rows.reshape(self.height, row_step)[:, :used]
        step = 1 + (self.width * self.height - 1) // most
        kept = rows.reshape(-1, self.point_step)[::step]
        return msgspec.structs.replace(
            self,
            height=1,
            width=len(kept),
            row_step=len(kept) * self.point_step,
            data=Octets(array("B", kept.tobytes())),
        )

    def has(self, name: str) -> bool:
        """Return whether points have a field of this name."""
        return any(field.name == name for field in self.fields)

    def _field(self, name: str) -> PointFieldMsg:
        for field in self.fields:
            if field.name == name:
                if field.datatype not in _FORMATS or field.offset < 0:
                    raise ProtocolError(
                        f"the field {name!r} has the datatype {field.datatype} at byte "
                        f"{field.offset}; datatypes are 1 to 8"
                    )
                return field
        known = ", ".join(repr(field.name) for field in self.fields) or "none"
        raise ProtocolError(f"points have no field {name!r}; they have {known}")

    @property
    def _row_step(self) -> int:
        """Bytes a row; some drivers leave that out of a cloud of a single row."""
        if self.row_step == 0 and self.height == 1:
            return self.width * self.point_step
        return self.row_step

    def _check_sizes(self, row_step: int) -> None:
        size = f"a cloud of {self.width} x {self.height} points"
        if self.width < 0 or self.height < 0:
            raise ProtocolError(f"{size} has less than none")
        if self.width * self.height > MAX_POINTS:
            raise ProtocolError(f"{size} is too large: {MAX_POINTS} are the limit")
        if self.point_step < 1 or row_step < self.width * self.point_step:
            raise ProtocolError(
                f"{size} of {self.point_step} bytes does not fit into rows of "
                f"{row_step} bytes"
            )
        if len(self.data) < row_step * self.height:
            raise ProtocolError(
                f"{size} has rows of {row_step} bytes, but came with "
                f"{len(self.data)} bytes in all"
            )
