"""The names and tags of all robots by their ids, by which people have rights."""

named_robots: dict[str, tuple[str, tuple[str, ...]]] = {}
"""The name and the tags of each robot; read by all threads."""
