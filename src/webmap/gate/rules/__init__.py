"""All decisions of the gate, without I/O: events and times in, actions out.

A rule that decides about motion belongs here; a socket, a file or a clock does not, and
an import contract refuses them. Open ``gate`` first, then ``machine``, which combines
the rules of one machine: ``authority`` (who has control), ``driving`` (its commands),
``motion`` (what is written), ``stop``, ``stop_test``, ``goals`` and ``assist``.
``report`` describes a machine to the pages.
"""
