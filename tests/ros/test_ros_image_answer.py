"""The responses and the addresses of HTTP cameras."""

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from equipment.camera_server import BOUNDARY, a_jpeg, part
from webmap.base.errors import ConfigError, ProtocolError
from webmap.ros.image_address import parse_address
from webmap.ros.image_pull import HttpResponseParser, Multipart
from webmap.ros.messages_image import MAX_BYTES

ONE, TWO = a_jpeg(), a_jpeg((0, 0, 200))
HEAD = (
    b'HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary="%s"\r\n\r\n'
)
STREAM = HEAD % BOUNDARY.encode() + f"--{BOUNDARY}\r\n".encode() + part(ONE) + part(TWO)


def fed(answer, data: bytes, size: int) -> list[bytes]:
    pieces = [data[at : at + size] for at in range(0, len(data), size)]
    return [picture for piece in pieces for picture in answer.feed(piece)]


@given(size=st.integers(1, len(STREAM)))
def test_a_stream_gives_the_same_pictures_for_any_chunk_size(size):
    assert fed(HttpResponseParser(), STREAM, size) == [ONE, TWO]


@given(size=st.integers(1, 700))
def test_pictures_without_a_content_length_end_at_the_boundary(size):
    body = b"".join(
        b"--x\nContent-Type: image/jpeg\n\n" + picture + b"\r\n"
        for picture in (ONE, TWO)
    )
    assert fed(Multipart("x"), body + b"--x\n", size) == [ONE, TWO]


def test_the_boundary_name_may_include_the_leading_dashes():
    body = b"--here\r\nContent-Length: %d\r\n\r\n%s\r\n--here" % (len(ONE), ONE)
    assert Multipart('"--here"').feed(body) == [ONE]


def test_a_single_picture_needs_no_content_length():
    answer = HttpResponseParser()
    head = b"HTTP/1.1 200 OK\nContent-Type: image/jpeg\n\n"
    assert answer.feed(head + ONE[:50]) == []
    assert answer.feed(ONE[50:]) == []
    assert answer.end() == [ONE]


def test_a_single_picture_with_a_content_length_needs_no_end_of_stream():
    head = b"HTTP/1.1 200 OK\r\nContent-Type: image/png\r\nContent-Length: 5\r\n\r\n"
    assert HttpResponseParser().feed(head + b"12345rest") == [b"12345"]


def answer_of(status="200 OK", kind="image/jpeg", more="", body=b"") -> bytes:
    head = f"HTTP/1.1 {status}\r\nContent-Type: {kind}\r\n{more}\r\n"
    return head.encode() + body


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (answer_of("302 Found", more="Location: http://10.0.0.1/\r\n"), "not followed"),
        (answer_of("404 Not Found"), "nothing at this address"),
        (answer_of("401 No"), "user and a password"),
        (answer_of("500 Oh"), "200 was expected"),
        (answer_of(kind="text/html; charset=utf-8"), "answers with text/html"),
        (b"HTTP/1.1 200 OK\r\n\r\n", "answers with nothing"),
        (answer_of(kind="multipart/x-mixed-replace"), "names no boundary"),
        (answer_of(kind='multipart/x-mixed-replace; boundary="--"'), "no boundary"),
        (answer_of(more="Transfer-Encoding: chunked\r\n"), "chunks"),
        (answer_of(more="Content-Length: 99999999\r\n"), "at most"),
        (b"SSH-2.0-OpenSSH_9.2\r\n\r\n", "does not speak HTTP"),
        ("HTTP/1.1 ²00 OK\r\n\r\n".encode("latin-1"), "does not speak HTTP"),
        (b"\r\n\r\n", "does not speak HTTP"),
        (b"x" * 20_000, "bytes of head"),
        (answer_of(body=b"\xff" * (MAX_BYTES + 1)), "more than"),
    ],
)
def test_an_invalid_camera_response_is_refused_with_a_reason(data, expected):
    with pytest.raises(ProtocolError, match=expected):
        HttpResponseParser().feed(data)


def test_a_camera_response_that_ends_too_early_is_refused():
    with pytest.raises(ProtocolError, match="without an answer"):
        HttpResponseParser().end()
    answer = HttpResponseParser()
    answer.feed(answer_of(more="Content-Length: 500\r\n", body=ONE[:100]))
    with pytest.raises(ProtocolError, match="in the middle"):
        answer.end()


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (b"no boundary " * 1000, "no boundary"),
        (b"--x\r\n" + b"Header: more\r\n" * 1000, "before a picture"),
        (b"--x\r\nContent-Length: -5\r\n\r\n", "bytes"),
        (b"--x\r\nContent-Length: 1e9\r\n\r\n", "bytes"),
        (b"--x\r\nContent-Length: 99999999\r\n\r\n", "at most"),
        (b"--x\r\n\r\n" + b"\xff" * (MAX_BYTES + 1), "more than"),
    ],
)
def test_an_invalid_stream_is_refused_before_filling_the_memory(body, expected):
    with pytest.raises(ProtocolError, match=expected):
        fed(Multipart("x"), body, 65536)


@given(data=st.binary(max_size=2000))
def test_any_bytes_give_pictures_or_a_protocol_error(data):
    for parser in (HttpResponseParser(), Multipart("x")):
        with contextlib.suppress(ProtocolError):
            assert all(parser.feed(data))


def test_an_address_gives_the_request_and_a_shown_form_without_secrets():
    address = parse_address("http://ann:p%40ss@cam.local:8080/stream?topic=/a&key=s3")
    assert (address.host, address.port, address.tls) == ("cam.local", 8080, False)
    request = address.request.decode()
    assert request.startswith("GET /stream?topic=/a&key=s3 HTTP/1.0\r\n")
    assert "Host: cam.local:8080\r\n" in request
    assert "Authorization: Basic YW5uOnBAc3M=\r\n" in request
    assert address.shown == "http://cam.local:8080/stream"
    secure = parse_address("https://[::1]")
    assert (secure.port, secure.tls, secure.target) == (443, True, "/")
    assert b"Host: [::1]:443" in secure.request


@pytest.mark.parametrize(
    "text",
    [
        "",
        "/stream",
        "file:///etc/passwd",
        "ftp://cam/",
        "rtsp://cam/stream",
        "http://",
        "http:///stream",
        "http://cam:port/",
        "http://cam:99999/",
        "http://cam/a b",
        "http://cam/\r\nHost: evil",
        "http://[cam/",
        "http://café/",
        None,
    ],
)
def test_an_invalid_camera_address_is_refused_with_an_example(text):
    with pytest.raises(ConfigError, match=r"http://robot\.local:8080/stream"):
        parse_address(text)


def test_the_error_for_a_refused_address_does_not_contain_its_password():
    with pytest.raises(ConfigError) as refused:
        parse_address("rtsp://ann:secret@cam/stream")
    assert "secret" not in str(refused.value)
