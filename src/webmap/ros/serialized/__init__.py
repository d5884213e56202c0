"""Serialized messages: the bytes that ROS nodes send to each other. No I/O.

``schemas`` reads the definition of a type in the text that a link or a recording gives.
``reader`` makes a function that reads the bytes of that type, in CDR (ROS 2) or in the
serialization of ROS 1; ``writer`` makes one that writes them. ``idl`` translates
definitions in IDL. Open ``schemas`` first.
"""
