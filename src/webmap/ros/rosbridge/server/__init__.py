"""A rosbridge v2.1 server over a small ROS graph that lives in this process."""
