"""The gate: the only process that moves robots. It belongs to one display.

All commands to robots pass it, and it stops a robot when commands do not arrive in
time. Nothing that draws, serves pages or reads the robots' sensors belongs here.

Open ``rules`` first: all decisions, without I/O. ``protocol`` has the messages between
display and gate, ``commands`` what a page sends, ``events`` and ``actions`` what goes
into the rules and comes out. ``process`` connects the rules with the sockets to the
robots (``lanes``), the files (``disk``, ``locks``) and the pipe to the display
(``pipe``). ``display`` is the other end of the pipe, and runs in the display's
process.
"""
