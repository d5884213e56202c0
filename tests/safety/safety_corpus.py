"""Invalid messages of a page: the gate refuses each, and none moves the robot.

A test replaces ``EPOCH``, ``TICK`` and ``SEQ`` by the values that are valid when it
sends the message, so that the gate refuses the message only because of its error.
"""

ROBOT = '"op":"drive","robot":"ROBOT"'
STAMP = '"epoch":EPOCH,"seq":SEQ,"tick":TICK'
REST = '"y":0.0,"turn":0.0'

NO_NUMBERS = [
    "NaN",
    "Infinity",
    "-Infinity",
    "1e999",
    "-1e999",
    '"0.5"',
    '""',
    "true",
    "null",
    "[0.5]",
    "{}",
    '{"x":1}',
    "0x1",
    "01",
    "+1",
    ".5",
    "1.",
    "1_0",
    "9" * 900,
]

CORPUS = [
    *(f'{{{ROBOT},{STAMP},"x":{x},{REST}}}' for x in NO_NUMBERS),
    *(f'{{{ROBOT},{STAMP},"x":0.5,"y":0.0,"turn":{x}}}' for x in NO_NUMBERS[:8]),
    # A field is missing, is unknown, or occurs twice.
    f'{{{ROBOT},{STAMP},"x":1.0,"y":0.0}}',
    f"{{{ROBOT},{STAMP},{REST}}}",
    f'{{{ROBOT},"epoch":EPOCH,"seq":SEQ,"x":1.0,{REST}}}',
    f'{{{ROBOT},"epoch":EPOCH,"tick":TICK,"x":1.0,{REST}}}',
    f'{{{ROBOT},"seq":SEQ,"tick":TICK,"x":1.0,{REST}}}',
    f'{{{ROBOT},{STAMP},"x":1.0,{REST},"z":0.0}}',
    f'{{{ROBOT},{STAMP},"x":1.0,{REST},"__proto__":{{}}}}',
    f'{{{ROBOT},{STAMP},"x":0.0,"x":1.0,{REST}}}',
    f'{{{ROBOT},{STAMP},"x":1.0,{REST},"x":1.0}}',
    f'{{"op":"drive","op":"drive","robot":"ROBOT",{STAMP},"x":1.0,{REST}}}',
    # A field has a wrong value.
    f'{{"op":"drive","robot":"nobody",{STAMP},"x":1.0,{REST}}}',
    f'{{"op":"drive","robot":"",{STAMP},"x":1.0,{REST}}}',
    f'{{"op":"drive","robot":7,{STAMP},"x":1.0,{REST}}}',
    f'{{"op":"Drive","robot":"ROBOT",{STAMP},"x":1.0,{REST}}}',
    f'{{{ROBOT},"epoch":0,"seq":SEQ,"tick":TICK,"x":1.0,{REST}}}',
    f'{{{ROBOT},"epoch":-1,"seq":SEQ,"tick":TICK,"x":1.0,{REST}}}',
    f'{{{ROBOT},"epoch":EPOCH.0,"seq":SEQ,"tick":TICK,"x":1.0,{REST}}}',
    f'{{{ROBOT},"epoch":"EPOCH","seq":SEQ,"tick":TICK,"x":1.0,{REST}}}',
    f'{{{ROBOT},"epoch":EPOCH,"seq":0,"tick":TICK,"x":1.0,{REST}}}',
    f'{{{ROBOT},"epoch":EPOCH,"seq":-5,"tick":TICK,"x":1.0,{REST}}}',
    f'{{{ROBOT},"epoch":EPOCH,"seq":SEQ,"tick":0,"x":1.0,{REST}}}',
    f'{{{ROBOT},"epoch":EPOCH,"seq":SEQ,"tick":TICK00,"x":1.0,{REST}}}',
    f'{{{ROBOT},"epoch":EPOCH,"seq":SEQ,"tick":null,"x":1.0,{REST}}}',
    # The text is not one whole message.
    "",
    " ",
    "drive",
    "[]",
    "{}",
    "7",
    "null",
    "{" * 400,
    "[" * 400,
    f'{{{ROBOT},{STAMP},"x":1.0,{REST}',
    f'{{{ROBOT},{STAMP},"x":1.0,{REST}}}{{{ROBOT},{STAMP},"x":1.0,{REST}}}',
    f'[{{{ROBOT},{STAMP},"x":1.0,{REST}}}]',
    f'\\ufeff{{{ROBOT},{STAMP},"x":1.0,{REST}}}',
    f'{{{ROBOT},{STAMP},"x":1.0,{REST}}}{" " * 2000}',
    f"{{{ROBOT},{STAMP},'x':1.0,{REST}}}",
]
