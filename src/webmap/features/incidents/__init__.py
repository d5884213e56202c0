"""The incident recorder: the last minutes of all robots, kept after a STOP or an alarm.

Open ``incidents.py`` first: it keeps recordings; ``observer.py`` makes the records.
"""
