"""What every other folder may use, and what imports none of them.

Errors, geometry, scopes, logging, plain files. Nothing here knows ROS, a robot or a
page.
"""
