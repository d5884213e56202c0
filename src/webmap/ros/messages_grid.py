"""Typed views of what goes with a grid."""

from typing import TYPE_CHECKING

from webmap.ros.arrays import Int8s
from webmap.ros.messages import Stamped, cells_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class OccupancyGridUpdateMsg(Stamped, frozen=True, kw_only=True):
    """``map_msgs/OccupancyGridUpdate``: a rectangle of a grid."""

    x: int
    """The first column."""

    y: int
    """The first row."""

    width: int
    height: int
    data: Int8s

    @property
    def cells(self) -> "NDArray[np.int8]":
        """The cells, of shape (height, width), read-only.

        Raises:
            ProtocolError: If there are more or fewer than the size says.

        """
        return cells_of(self.data, self.width, self.height)
