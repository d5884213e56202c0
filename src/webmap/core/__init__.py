"""Maps, robots, pages and the modules that extend them.

Everything here runs in the model's thread. It knows the scene, the bridges and, of the
browser, the session of a page. Open ``extendable`` first, then ``robot`` and ``map``.
What draws one kind of message belongs in ``webmap.features``; how a pose is computed,
in ``webmap.poses``.
"""
