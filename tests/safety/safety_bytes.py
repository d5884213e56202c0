"""The corpus of bytes for parsers: valid messages of each kind, and nasty ones.

Each test starts from these and changes them. Whoever finds bytes that break a parser
adds them to :data:`NASTY`.
"""

import io
import json

import cbor2
import msgspec
from PIL import Image

from webmap.agents.camera_messages import CameraRequest
from webmap.agents.data_messages import SubscribeOp


def _json(**fields) -> bytes:
    return json.dumps(fields).encode()


def _picture(form: str) -> bytes:
    file = io.BytesIO()
    Image.new("RGB", (3, 2), "red").save(file, form)
    return file.getvalue()


SCAN = {
    "header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "laser"},
    **{"angle_min": -1.0, "angle_max": 1.0, "angle_increment": 0.5},
    **{"range_min": 0.1, "range_max": 9.0, "ranges": [1.0, 2.0, 3.0, 4.0, 5.0]},
}

STATUS = {
    "header": {"stamp": {"secs": 1, "nsecs": 2}, "frame_id": ""},
    "status_list": [{"goal_id": {"id": "g1"}, "status": 1, "text": "on its way"}],
    "status": {"goal_id": {"id": "g1"}, "status": 3, "text": "there"},
    "feedback": {"distance_remaining": 1.0, "number_of_recoveries": 0},
}

VALID = [
    _json(op="publish", topic="/scan", msg=SCAN),
    _json(op="publish", topic="/move_base/status", msg=STATUS),
    _json(op="action_feedback", id="g1", action="/navigate", values=STATUS["feedback"]),
    _json(op="action_result", id="g1", action="/navigate", status=4, result=True),
    _json(op="service_response", id="call", service="/stop", values={"success": True}),
    _json(op="status", level="error", msg="no such topic", id="x"),
    _json(op="fragment", id="f", num=0, total=2, data="{}"),
    _json(op="png", data="iVBORw0KGgo="),
    _json(op="subscribe", topic="/scan", id="s1", type="", throttle_rate=0),
    cbor2.dumps({"op": "publish", "topic": "/scan", "msg": SCAN}),
    cbor2.dumps({"op": "publish", "topic": "/s", "secs": 1, "msg": {"bytes": b"abc"}}),
    cbor2.dumps({"op": "publish", "topic": "/p", "msg": {"a": cbor2.CBORTag(85, b"")}}),
    msgspec.msgpack.encode(CameraRequest(1, "r", "front")),
    msgspec.msgpack.encode({"type": "sub", "topic": "/scan"}),
    msgspec.json.encode(SubscribeOp("subscribe", "/scan", "s1")),
    b'{"type":"hello","width":800,"height":600,"maps":[[1,800,600]]}',
    b'{"t":"event","mount":1,"element":2,"kind":"click","x":1.5,"y":2.5}',
    b'{"op":"drive","robot":"r1","epoch":3,"seq":17,"tick":812,"x":1,"y":0,"turn":0}',
    b"\0\1\0\0\1\0\0\0\2\0\0\0\4\0\0\0map\0" + bytes(200),  # CDR
    b"\0\0\0\0\0\0\0\1\0\0\0\2\0\0\0\4map\0" + bytes(200),
    b"\0\1\0\0\2\0\0\0" + 2 * (bytes(8) + 2 * b"\2\0\0\0a\0\0\0" + bytes(56)),
    b"\5\0\0\0\1\0\0\0\2\0\0\0\3\0\0\0map" + bytes(200),  # ROS 1
    b"GET /stream?topic=/camera&width=5 HTTP/1.1\r\nhost: x\r\n\r\n",
    b"HTTP/1.1 200 OK\r\ncontent-type: multipart/x-mixed-replace; boundary=b\r\n\r\n",
    b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"><path d="M0 0"/></svg>',
    *(_picture(form) for form in ("PNG", "JPEG", "WEBP", "GIF", "BMP")),
]

NASTY = [
    b"",
    b"\0",
    b"\xff" * 40,
    b"\xef\xbb\xbf{}",
    b"null",
    b"[]",
    b"{}",
    b"{" * 3000,
    b"[" * 3000,
    b'{"op":' * 500,
    b'{"op":"publish","topic":"/t","msg":' + b"9" * 5000 + b"}",
    b'{"op":"publish","topic":"/t","msg":{"x":1e999,"y":NaN,"z":-Infinity}}',
    b'{"op":"publish","op":"publish","topic":"/t","topic":"/u","msg":{},"msg":[]}',
    b'{"op":"publish","topic":"\\ud800","msg":{"\\udfff":"\\u0000"}}',
    b'{"op":"publish","topic":"/t","msg":{"ranges":"not base64!"}}',
    b'{"op":"publish","topic":"/t","msg":{"stamp":{"secs":-1,"nsecs":1e20}}}',
    b"\0\1\0\0\xff\xff\xff\xff",
    b"\0\7\0\0" + bytes(40),
    b"\x9f" * 2000,  # CBOR: lists without an end
    b"\xbf" * 2000,
    b"\x9b\xff\xff\xff\xff\xff\xff\xff\xff",  # a list of 2^64 - 1 items
    b"\xbb\x7f\xff\xff\xff\xff\xff\xff\xff",
    b"\x5b\x7f\xff\xff\xff\xff\xff\xff\xff",
    b"\xc2\x5a\x00\x10\x00\x00" + b"\x01" * 64,
    b"\xd8\x1c\x81\xd8\x1d\x00",  # a value that contains itself
    b"\xd9\x01\x00" * 500 + b"\x80",
    b"\xdd\xff\xff\xff\xff",  # MessagePack: a list of 2^32 - 1 items
    b"\xdf\xff\xff\xff\xff",
    b"\xc6\xff\xff\xff\xff",
    b"\x28\xb5\x2f\xfd" + b"\0" * 20,
    b"\x78\x9c" + b"\0" * 20,
    b"\x1f\x8b\x08" + b"\0" * 20,
    b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\x7f\xff\xff\xff\x7f\xff\xff\xff\x08\x02\0\0\0",
    b"\xff\xd8\xff\xc0\0\x11\x08\xff\xff\xff\xff\x03",
    b"\xff\xd8" + b"\xff\xe0\0\x02" * 400,
    b"RIFF\xff\xff\xff\xffWEBPVP8X\x0a\0\0\0\0\0\0\0\xff\xff\xff\xff\xff\xff",
    b"P5\n2147483647 2147483647\n255\n",
    b"P2 1 1 65535 -1",
    b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "c">]><svg>&b;</svg>',
    b"<svg " * 1000,
    b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 500,
]

CORPUS = [*VALID, *NASTY]
