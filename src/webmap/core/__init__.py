"""Maps, robots, pages and the modules that extend them.

Everything here runs in the model's thread. It knows the scene, the bridges and, of the
browser, the session of a page. Open ``extendable`` first, then ``robot`` and ``map``.
Imports go one way: ``base_page``, ``world_view``, ``movable_robot``, ``visible_robot``,
``robot``, ``map``, ``page``.
What draws one kind of message belongs in ``webmap.features``; how a pose is computed,
in ``webmap.poses``.
"""
