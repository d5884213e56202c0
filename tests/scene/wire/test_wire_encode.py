import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.geometry import Affine
from webmap.scene import html, svg
from webmap.scene.allowed import ATTRIBUTES
from webmap.scene.document import Document
from webmap.scene.node import Fragment
from webmap.scene.wire.dots import PageDots
from webmap.scene.wire.encode import (
    _SLOTS,
    encode_changes,
    encode_snapshot,
)
from webmap.scene.wire.opcodes import TAGS, Op, string, varint


def read_varint(data):
    number = shift = 0
    for index, byte in enumerate(data):
        number |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            return number, data[index + 1 :]
    raise AssertionError("no end")


@given(st.integers(0, 2**53))
def test_a_varint_survives_encoding_and_decoding(number):
    assert read_varint(varint(number)) == (number, b"")


@given(st.text())
def test_a_string_is_encoded_after_its_length(text):
    length, data = read_varint(string(text))
    assert (len(data), data.decode()) == (length, text)


def records_since(fragment, revision):
    """Return the records of the changes, without the head of their section."""
    head = bytes([Op.DELTA]) + varint(fragment.id)
    data = encode_changes(fragment, revision)
    assert data.startswith(head)
    return data[len(head) :]


def test_an_unchanged_fragment_is_encoded_as_no_bytes():
    fragment = Fragment(svg.g())
    assert encode_changes(fragment, fragment.revision) == b""


def test_a_lone_surrogate_is_encoded_as_a_question_mark():
    assert string("a\ud800") == b"\x02a?"


def test_a_pose_is_at_most_18_bytes():
    root = svg.g()
    fragment = Fragment(root)
    root.set_pose(1.5, -2, 0.25)
    data = records_since(fragment, 0)
    assert data == bytes([Op.POSE]) + varint(root.id) + struct.pack(
        "<fff", 1.5, -2, 0.25
    )
    head = len(bytes([Op.DELTA]) + varint(1000))
    assert head + 1 + len(varint(10_000)) + 12 <= 18


def test_a_dot_needs_two_bytes_per_coordinate():
    path = svg.path()
    fragment = Fragment(path)
    path.set_dots(bytes(4 * 360), 0.001)
    data = PageDots({}, {}).records(fragment, 0)
    assert encode_changes(fragment, 0) == b""
    assert len(data) - 4 * 360 <= 1 + len(varint(path.id)) + 4 + 2


def test_a_far_pose_keeps_millimetre_precision():
    root = svg.g()
    fragment = Fragment(root)
    root.set_pose(500_000.123, 5_000_000.456, 7)
    data = records_since(fragment, 0)
    assert data[0] == Op.FAR_POSE
    x, y, yaw = struct.unpack("<ddf", data[-20:])
    assert (x, y) == (500_000.123, 5_000_000.456)
    assert yaw == pytest.approx(7 - 2 * 3.14159265358979)


@pytest.mark.parametrize("yaw", [1e300, -1e300])
def test_a_huge_angle_can_be_encoded(yaw):
    root = svg.g()
    root.set_pose(0, 0, yaw)
    assert encode_snapshot(Fragment(root))


def test_the_encoding_of_a_fragment_is_cached_until_its_next_change():
    root = svg.g()
    fragment = Fragment(root)
    root.set_matrix(Affine(e=3))
    assert encode_changes(fragment, 0) is encode_changes(fragment, 0)
    assert encode_snapshot(fragment) is encode_snapshot(fragment)
    before = encode_snapshot(fragment)
    root.set_matrix(Affine(e=4))
    assert encode_snapshot(fragment) is not before


def test_only_the_class_and_transform_slots_share_names_with_attributes():
    assert set(_SLOTS) & set(ATTRIBUTES) == {"class", "transform"}


def test_a_tag_of_both_namespaces_has_two_different_encodings():
    both = {tag for tag in TAGS if TAGS.count(tag) > 1}
    for tag in both:
        in_svg = encode_snapshot(Fragment(getattr(svg, tag)()))
        in_html = encode_snapshot(Fragment(getattr(html, tag)()))
        assert in_svg[-1] != in_html[-1]


def test_a_bound_element_is_encoded_with_its_html_id():
    document = Document()
    document.bind("log")
    data = encode_snapshot(Fragment(document))
    assert data[0] == Op.DOCUMENT
    assert data.endswith(b"\x03log")


def test_an_unset_attribute_is_encoded_as_unset():
    root = svg.g(fill="red")
    fragment = Fragment(root)
    root.set(fill=None, data_name="Bob")
    root.unset("data-name")
    ops = records_since(fragment, 0)
    assert ops[0] == Op.UNSET
    assert ops.endswith(b"\x09data-name")


def test_an_unset_attribute_of_the_page_html_is_unset_for_later_viewers():
    """The page's HTML may have the attribute, as a card that is hidden at first."""
    document = Document()
    fragment = Fragment(document)
    card, since = document.bind("card"), fragment.revision
    card.set(hidden=False)
    unset = records_since(fragment, since)
    assert unset[0] in (Op.UNSET, Op.NAMED_UNSET)
    assert encode_snapshot(fragment).endswith(bytes(unset))
    card.set(hidden=True)
    assert bytes(unset) not in encode_snapshot(fragment)
