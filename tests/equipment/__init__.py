"""Equipment of the tests: what tests of more than one folder use, and no test itself.

- Programs: ``webmap_process`` and ``processes`` run WebMap as a user does,
  ``command_line`` runs a command in this process, ``console_page`` opens the console of
  a command in a browser, ``simulator_fixtures`` are simulators for tests of commands.
- Browsers: ``chromium`` is a real one that reports its errors, ``devtools`` controls
  one whose pages can be hidden, ``scene_host`` serves a scene to it.
- Robots and bridges: ``fake_rosbridge``, ``hanging_bridge`` and ``camera_server`` are
  servers that tests control, ``captured_frames`` names frames of real rosbridge servers
  and ``frame_player`` plays them, ``bag_files`` writes recordings.
- Parts of WebMap alone: ``gate_harness`` has the gate's rules with a clock of its own,
  ``server_fakes`` replaces everything behind the web server, ``ray_points`` computes
  the dots of a scan.
- ``environment`` gives all tests the same locale, folders and fonts, and ``waiting``
  waits until something is true.

Test tools that users need too are in the package: ``webmap.testing`` has the witness
robot, the fault proxy and the invariants of motion, and ``webmap sim`` has the quirks
of rosbridge (``--quirks``) and the cameras of web_video_server (``--http-camera``).

What only the tests of one folder use is in that folder.
"""
