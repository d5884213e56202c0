"""Robots as commands show them: from fleet files, from options and from discovery.

Open ``fleet_file`` for fleet files, ``search`` and ``view_robots`` for what ``webmap
view`` does, and ``agent`` for ``webmap agent``. ``robot_options`` and ``overrides``
read ``--robot`` and ``--set``; ``periodic_search`` finds later robots and topics.
``agent_robots`` are the robots of an agent, ``remote_robots`` those of agents on a
console, and ``robot_files`` decides which files and addresses pass between both. The
settings themselves are in ``webmap.config``; the rules that find robots are in
``webmap.discovery``.
"""
