"""What this process counts since its start, for ``/metrics``."""

from collections import Counter

counts: Counter[str] = Counter()
"""Each name is counted in one thread only."""
