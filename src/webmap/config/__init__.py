"""How robots and fleets are configured, and the one check of it.

``motion`` has everything that moves a robot, ``robot`` the whole robot, ``fleet`` the
fleet file; each is a msgspec Struct whose annotations name the checks of its fields.
``checks`` reads plain values into such a Struct and collects every mistake.
``toml_text`` knows on which line of a file a value is, and whether passwords are in it.
Nothing here makes a robot: ``webmap.core.robot`` does. Open ``robot`` first.
"""
