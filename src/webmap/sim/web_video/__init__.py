"""The cameras over HTTP, at the addresses that ``web_video_server`` gives them."""

from webmap.sim.web_video.server import WebVideoServer

__all__ = ["WebVideoServer"]
