"""The gate: the process through which all motion goes.

Read it in this order: ``messages`` (what crosses the pipe), ``commands`` and
``reports`` (what crosses the socket to a page), then the decisions, none of which
does I/O: ``ticks``, ``lease``, ``limits``, ``deadman``, ``health``, ``goals``,
``base`` (one machine) and ``gate`` (all of them). Around them, the shell: ``sockets``,
``lanes`` and ``links`` towards the robots, ``process`` towards the display, and
``client``, which is the display's end of the pipe.
"""
