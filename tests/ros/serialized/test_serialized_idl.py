"""Schemas in IDL, as rosidl generates them."""

import contextlib
import re

import pytest
from rosbags.typesys import get_types_from_idl

from webmap.base.errors import ConfigError
from webmap.ros.serialized.idl import messages_of
from webmap.ros.serialized.reader import make_reader
from webmap.ros.serialized.schemas import read_schema
from webmap.ros.serialized.writer import make_writer

HEADER = """============================================================
IDL: std_msgs/msg/Header
// generated from rosidl_adapter/resource/msg.idl.em
// with input from std_msgs/msg/Header.msg

#include "builtin_interfaces/msg/Time.idl"

module std_msgs {
  module msg {
    @verbatim (language="comment", text=
      "Standard metadata (\\"stamped\\") // for data;" "\\n"
      "}")
    struct Header {
      @verbatim (language="comment", text="seconds")
      builtin_interfaces::msg::Time stamp;

      string frame_id;
    };
  };
};
================================================================================
IDL: builtin_interfaces/msg/Time
module builtin_interfaces {
  module msg {
    struct Time {
      int32 sec;

      uint32 nanosec;
    };
  };
};
"""

MAIN = """============================================================
IDL: nav/msg/Fix
#include "std_msgs/msg/Header.idl"
/* A comment of
 * two lines. */
module nav {
  module msg {
    typedef double double__9[9];
    typedef nav::msg::Part nav__msg__Part__2[2];
    module Fix_Constants {
      const uint8 KNOWN = 3;
      @verbatim (language="comment", text="name")
      const string NAME = "a;b";
    };
    @verbatim (language="comment", text="a fix")
    struct Fix {
      std_msgs::msg::Header header;
      @default (value=1.5)
      double latitude;
      @unit (value="m")
      double__9 covariance;
      nav__msg__Part__2 pair;
      sequence<nav::msg::Part> parts;
      sequence<octet, 4> few;
      sequence<string> names;
      string<8> short_name;
      boolean good;
      long long big, other;
      unsigned short small;
      unsigned long long huge;
      char letter;
      float x[3];
      nav::msg::Nothing nothing;
    };
  };
};
================================================================================
IDL: nav/msg/Part
module nav { module msg { struct Part { uint8 a; double b; }; }; };
================================================================================
IDL: nav/msg/Nothing
module nav { module msg { struct Nothing {
  uint8 structure_needs_at_least_one_member; }; }; };
"""

FIX = """std_msgs/Header header
float64 latitude 1.5
float64[9] covariance
nav/Part[2] pair
nav/Part[] parts
byte[<=4] few
string[] names
string<=8 short_name
bool good
int64 big
int64 other
uint16 small
uint64 huge
char letter
float32[3] x
nav/Nothing nothing
====
MSG: nav/Part
uint8 a
float64 b
====
MSG: nav/Nothing
====
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""


def test_idl_gives_the_same_fields_as_msg():
    ours = read_schema("nav/msg/Fix", "ros2idl", MAIN + HEADER)
    assert ours.fields == read_schema("nav/msg/Fix", "ros2msg", FIX).fields
    message = make_reader(ours, None, "cdr")(make_writer(ours, "cdr")({}))
    assert message["latitude"] == 1.5
    assert message["nothing"] == {}
    assert len(message["pair"]) == 2


def test_idl_names_the_same_fields_as_rosbags():
    text = MAIN.partition("IDL: nav/msg/Nothing")[0]
    text = re.sub("^(=|IDL|#).*$", "", text, flags=re.MULTILINE)
    theirs = get_types_from_idl(text)["nav/msg/Fix"][1]
    ours = messages_of(MAIN)["nav/msg/Fix"]
    assert [name for name, _ in theirs] == [
        line.split()[1] for line in ours.splitlines()
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("module a { enum E { X }; };", "'enum'"),
        ("module a { module msg { struct B { wstring x; }; }; };", "wstring"),
        ("module a { module msg { struct B { wchar x; }; }; };", "a/wchar"),
        ("module a { module msg { struct B { long short x; }; }; };", "a/long"),
        ("struct B { sequence<sequence<long>> x; };", "array of arrays"),
        ("struct B { long x[2][3]; };", "array of arrays"),
        ("typedef long T[2]; struct B { sequence<T> x; };", "array of arrays"),
        ("struct B { long x[N]; };", "N where a number"),
        ("module a { module b { module c { module d { module e {", "modules in"),
        ("module a { /* no end", "comment without an end"),
        ("module a { struct B { long x; }; }", "its end where ;"),
        ("module a {", "its end"),
        ("module a { module msg { struct B { long x y; }; }; };", "y where ;"),
    ],
)
def test_other_idl_is_refused_with_its_reason(text, words):
    with pytest.raises(ConfigError, match=words):
        read_schema("a/msg/B", "ros2idl", text)


def test_no_part_of_a_text_breaks_the_parser():
    for size in range(len(MAIN)):
        with contextlib.suppress(ConfigError):
            read_schema("nav/msg/Fix", "ros2idl", MAIN[:size])
        with contextlib.suppress(ConfigError):
            read_schema("nav/msg/Fix", "ros2idl", MAIN[size : size + 300])


@pytest.mark.parametrize("piece", ["/*", "/", '"', "@", "@a(", "(", "=\n", "\n", "#"])
def test_long_texts_without_sense_are_refused_soon(piece):
    with pytest.raises(ConfigError):
        read_schema("nav/msg/Fix", "ros2idl", piece * 100_000)
