"""The gate: the process through which all motion goes.

Read it in this order: ``messages`` (what crosses the pipe), ``commands`` and
``reports`` (what crosses the socket to a page), ``events`` and ``actions`` (what the
decisions are told, and what they ask for), then the decisions themselves, which are
all in ``rules`` and do no I/O.

Around them is the shell, which decides nothing: ``lanes`` towards the robots, ``kept``
for what outlives the gate, ``shell``, which brings all of that together, ``process``
towards the display, and ``display``, the other end of that pipe, which is the only part
of this package that runs in another process.
"""
