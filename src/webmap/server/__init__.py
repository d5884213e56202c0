"""The web application: pages, files, sign-in, the sockets, and the server.

The only package that imports the web stack, which is loaded when a program starts to
serve: ``import webmap`` loads none of it. What a page shows and does is decided below,
in :mod:`webmap.core` and :mod:`webmap.scene.wire`; what moves a robot, in the gate.

Begin with ``app``, which routes requests: ``security`` and ``access`` let them in,
``sockets`` serves a page's sockets, ``open_pages`` has the pages, and ``html``,
``files`` and ``own_files`` are what browsers load; ``bundles`` makes few files of many.
``application`` has the public functions, and ``runner`` is the server that they run.
"""
