"""What the gate decides, without any I/O: told what came and when, it says what to do.

Read ``gate`` first, then ``fleet`` and ``base``, which is one machine with all of its
rules. What one rule needs: ``ticks``, ``lease``, ``ages``, ``loopage``, ``deadman``,
``health``, ``sight``, ``arming``, ``goals``, ``latch``, ``confirm``, ``handover``,
``stoptest``, ``obedience``, ``assist``. What one machine does with them: ``speeds``,
``motion``, ``stoptesting``, ``hands`` (who has it), ``driving`` (what commands come
to), ``standing`` (a STOP that stands). What comes in: ``orders`` of pages and
``programorders``.

Nothing here knows a socket, a file or a clock; the linter sees to it.
"""
