"""Maps, robots and the modules that extend them: what a user of WebMap holds.

Everything here lives in the model's thread. It knows the scene and the bridges, and
of the browser only the session of a page, ``webmap.scene.wire.session.SceneSession``.
"""
