import gzip

import pytest

from webmap.server import files
from webmap.server.files import GzipCache, accepts_gzip, is_worth_compressing


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
    assert is_worth_compressing("text/css; charset=utf-8", 10_000)
    assert is_worth_compressing("image/svg+xml; charset=utf-8", 10_000)
    assert not is_worth_compressing("image/png", 10_000)
    assert not is_worth_compressing("text/css", 20)
    assert not is_worth_compressing("text/css", files.MOST_COMPRESSED_BYTES + 1)


def test_equal_content_is_compressed_once():
    store = GzipCache()
    first = store.compressed(b"a" * 1000)
    assert gzip.decompress(first) == b"a" * 1000
    assert store.compressed(bytes(bytearray(b"a" * 1000))) is first


def test_what_was_not_used_for_longest_is_dropped_when_the_store_is_full(monkeypatch):
    monkeypatch.setattr(files, "MOST_STORED_BYTES", 2500)
    store = GzipCache()
    one, two = store.compressed(b"1" * 1000), store.compressed(b"2" * 1000)
    assert store.compressed(b"1" * 1000) is one
    store.compressed(b"3" * 1000)
    assert store.compressed(b"1" * 1000) is one
    assert store.compressed(b"2" * 1000) is not two
