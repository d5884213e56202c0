import gzip

import pytest

from webmap.server import packed
from webmap.server.packed import Packed, accepts_gzip, may_pack


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("gzip", True),
        ("gzip, deflate, br, zstd", True),
        ("br , gzip ; q=0.1", True),
        ("gzip;q=1", True),
        ("gzip;q=0", False),
        ("gzip; q=0.000", False),
        ("", False),
        ("br, x-gzip", False),
        ("identity", False),
    ],
)
def test_gzip_is_for_browsers_that_read_it(header, expected):
    assert accepts_gzip(header) is expected


def test_texts_are_compressed_and_pictures_and_very_short_ones_are_not():
    assert may_pack("text/css; charset=utf-8", 10_000)
    assert may_pack("image/svg+xml; charset=utf-8", 10_000)
    assert not may_pack("image/png", 10_000)
    assert not may_pack("text/css", 20)
    assert not may_pack("text/css", packed.MOST_BYTES + 1)


def test_equal_content_is_compressed_once():
    store = Packed()
    first = store.of(b"a" * 1000)
    assert gzip.decompress(first) == b"a" * 1000
    assert store.of(bytes(bytearray(b"a" * 1000))) is first


def test_what_was_not_used_for_longest_is_dropped_when_the_store_is_full(monkeypatch):
    monkeypatch.setattr(packed, "MOST_STORED_BYTES", 2500)
    store = Packed()
    one, two = store.of(b"1" * 1000), store.of(b"2" * 1000)
    assert store.of(b"1" * 1000) is one
    store.of(b"3" * 1000)
    assert store.of(b"1" * 1000) is one
    assert store.of(b"2" * 1000) is not two
