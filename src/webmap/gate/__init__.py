"""The gate: the process through which all motion goes.

Read it in this order: ``messages`` (what crosses the pipe), ``commands`` and
``reports`` (what crosses the socket to a page), then the decisions, none of which
does I/O. What one rule needs: ``ticks``, ``lease``, ``limits``, ``loopage``,
``deadman``, ``health``, ``sight``, ``arming``, ``goals``, ``latch``, ``confirm``,
``handover``, ``stoptest``, ``obedience``, ``unproven``. What one machine does with
them: ``speeds``, ``motion``, ``stoptesting``, ``hands`` (who has it), ``driving`` (what
commands come to), ``standing`` (a STOP that stands) and ``base``, which is all of that.
What comes in: ``orders`` of pages, ``programorders``, ``fleet`` (all machines) and
``gate``. Around them, the shell: ``sockets``, ``calls``, ``lanes`` and ``links``
towards the robots, ``disk`` and ``records`` for what outlives it, ``shell``, which
brings all of that together, and ``process`` towards the display.
The display's end of the pipe is ``client``, with ``supervisor``, ``restarts``,
``unheard``, ``pages`` and ``program``.
"""
