"""The gate: the process through which all motion goes.

Read it in this order: ``messages`` (what crosses the pipe), ``commands`` and
``reports`` (what crosses the socket to a page), then the decisions, none of which
does I/O: ``ticks``, ``lease``, ``limits``, ``loopage``, ``deadman``, ``health``,
``arming``, ``goals``, ``latch``, ``confirm``, ``standing`` (a STOP that stands),
``handover``, ``stoptest``, ``obedience``, ``base`` (one machine) and ``gate`` (all of
them). Around them, the shell: ``sockets``, ``lanes`` and ``links`` towards the robots,
``disk`` and ``records`` for what outlives it, ``process`` towards the display, and
``client``, which is the display's end of the pipe.
"""
