"""Where robots are: from odometry and frames to a pose on the common map.

Open ``pipeline.py`` first: ``PosePipeline`` decides without I/O. ``webmap.core`` feeds
the pipeline and shows the poses. Frames themselves (``tf``) are in ``webmap.ros.tf``.
"""
