"""The link to ROS: rosbridge v2 as a client, messages, and names."""
