"""Where a layer lies whose data is in another frame than the map's."""

from webmap.core.layer_frames import LayerFrames, not_known
from webmap.core.placed import put
from webmap.core.whereabouts import affine
from webmap.geometry import Affine, Pose
from webmap.tf import TransformError


class Anchored(LayerFrames):
    """Keeps a whole layer where the frames of a ROS system have its data."""

    def _begin(self) -> None:
        self._frame: str | None = None
        self._offset = Affine()

    def stand_in(self, frame_id: str, stamp: float) -> None:
        """Take the layer's coordinates to be in a frame, as it was at a time.

        Afterwards the layer moves as the frame does.

        Args:
            frame_id: The frame of a message; empty if it does not say.
            stamp: In seconds of the robot's clock; 0 if not said.

        """
        source = self._source(frame_id)
        if source is not None:
            self._frame = source
            self._place(source, stamp)

    def _news(self) -> None:
        if self._frame is not None:
            self._place(self._frame, 0.0)

    def _place(self, source: str, stamp: float) -> None:
        try:
            found, _ = self._look(source, stamp)
        except TransformError as error:
            self._say(not_known(source, error))
            return
        self._offset = found.from_above
        self._align(self.alignment)
        self._say("")

    def _align(self, aligned: Pose) -> None:
        put(self._layer.svg, affine(aligned) @ self._offset)
