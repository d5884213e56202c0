"""Camera pictures over HTTP, with the addresses of ``web_video_server``.

For tests and the demo of cameras over HTTP. Open ``server`` first.
"""

from webmap.sim.web_video.server import WebVideoServer

__all__ = ["WebVideoServer"]
