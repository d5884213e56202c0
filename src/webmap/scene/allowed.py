"""The allow-list of the scene: tags, attributes, events and URLs.

The browser has the same tables: messages contain positions in them, and a page cannot
make an element that has no position. Attribute values are also converted to text here.
"""

import difflib
import math
import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Any

from webmap.base.errors import SceneError


def _words(text: str) -> tuple[str, ...]:
    return tuple(text.split())


SVG_TAGS = _words(
    """
    circle clipPath defs desc ellipse g image line linearGradient marker mask path
    pattern polygon polyline radialGradient rect stop svg symbol text textPath title
    tspan use
    """
)
"""The SVG tags; none that runs scripts, animates attributes or embeds markup."""

HTML_TAGS = _words(
    """
    a article aside br button canvas caption code dd details dialog div dl dt em
    fieldset figcaption figure footer h1 h2 h3 h4 header hr img input kbd label legend
    li main meter nav ol optgroup option output p pre progress section select small
    span strong summary table tbody td textarea tfoot th thead time tr ul
    """
)
"""The HTML tags; no forms, frames, scripts or styles."""

_COMMON = _words("class dir id lang role tabindex")

_SVG_ATTRIBUTES = _words(
    """
    alignment-baseline clip-path clip-rule clipPathUnits color cx cy d
    dominant-baseline dx dy fill fill-opacity fill-rule font-family font-size
    font-style font-weight fx fy gradientTransform gradientUnits height href
    image-rendering letter-spacing lengthAdjust marker-end marker-mid marker-start
    markerHeight markerUnits markerWidth mask maskContentUnits maskUnits offset
    opacity orient overflow paint-order patternContentUnits patternTransform
    patternUnits pathLength pointer-events points preserveAspectRatio r refX refY
    rotate rx ry shape-rendering spreadMethod startOffset stop-color stop-opacity
    stroke stroke-dasharray stroke-dashoffset stroke-linecap stroke-linejoin
    stroke-miterlimit stroke-opacity stroke-width text-anchor text-decoration
    text-rendering textLength transform transform-origin vector-effect viewBox
    visibility width x x1 x2 y y1 y2
    """
)

_HTML_ATTRIBUTES = _words(
    """
    accesskey alt autocomplete checked cols colspan datetime disabled draggable
    enterkeyhint for height hidden high href inert inputmode label low max maxlength
    min minlength multiple name open optimum pattern placeholder popover popovertarget
    readonly required reversed rows rowspan scope selected size spellcheck src start
    step title translate type value width wrap
    """
)

ATTRIBUTES = tuple(sorted({*_COMMON, *_SVG_ATTRIBUTES, *_HTML_ATTRIBUTES}))
"""Every attribute with a fixed name; ``data-*`` and ``aria-*`` are allowed too."""

BOOLEAN_ATTRIBUTES = frozenset(
    _words(
        """
    checked disabled hidden inert multiple open readonly required reversed selected
        """
    )
)
"""Attributes that are present or absent, without a value."""

EVENTS = _words(
    """
    blur change click contextmenu dblclick focus input keydown keyup mousedown
    mouseenter mouseleave mousemove mouseup pointercancel pointerdown pointerenter
    pointerleave pointermove pointerup toggle wheel
    """
)
"""The events that an element may listen to."""

_ATTRIBUTES_OF = {
    "svg": frozenset((*_COMMON, *_SVG_ATTRIBUTES)),
    "html": frozenset((*_COMMON, *_HTML_ATTRIBUTES)),
}
_TAGS_OF = {"svg": frozenset(SVG_TAGS), "html": frozenset(HTML_TAGS)}
_FREE_NAME = re.compile(r"(?:data|aria)-[a-z0-9_]+(?:-[a-z0-9_]+)*")
_PROPERTY = re.compile(r"--[A-Za-z0-9_][A-Za-z0-9_-]*")
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
_LOCAL_URL = re.compile(r"url\(\s*#[A-Za-z_][\w.-]*\s*\)")
_LOCAL_HREF = re.compile(r"#[A-Za-z_][\w.-]*")
_UNSAFE = re.compile(r"[\x00-\x1f\x7f\\]|^\s|^//")
_INPUT_TYPES = _words("checkbox color number radio range search text")


def _unknown(what: str, name: object, known: Iterable[str]) -> SceneError:
    """Return an error that names the allowed names nearest to ``name``."""
    near = difflib.get_close_matches(str(name), list(known), n=3, cutoff=0.5)
    hint = f"; nearest are {', '.join(map(repr, near))}" if near else ""
    return SceneError(f"{what} {name!r} is not allowed in a scene{hint}")


def check_tag(namespace: str, tag: str) -> None:
    """Refuse a tag outside the allow-list.

    Raises:
        SceneError: If ``tag`` is not allowed, with the nearest allowed tags.

    """
    if namespace not in _TAGS_OF:
        raise _unknown("namespace", namespace, _TAGS_OF)
    if tag not in _TAGS_OF[namespace]:
        raise _unknown(f"{namespace} tag", tag, _TAGS_OF[namespace])


@lru_cache(maxsize=4096)
def attribute_name(namespace: str, key: str) -> str:
    """Return the attribute name of a Python keyword argument.

    ``class_`` is ``class`` and ``stroke_width`` is ``stroke-width``.

    Raises:
        SceneError: If there is no such attribute, with the nearest allowed names.

    """
    name = key.removesuffix("_").replace("_", "-")
    allowed = _ATTRIBUTES_OF[namespace]
    if name in allowed or _FREE_NAME.fullmatch(name):
        return name
    if name == "style":
        raise SceneError(
            "the style attribute is not allowed in a scene: use attributes, classes, "
            "or set_style('--name', value)"
        )
    raise _unknown(f"{namespace} attribute", name, allowed)


def check_event(kind: str) -> None:
    """Refuse an event that an element cannot listen to.

    Raises:
        SceneError: If ``kind`` is not allowed, with the nearest allowed events.

    """
    if kind not in EVENTS:
        raise _unknown("event", kind, EVENTS)


def check_property(name: str) -> None:
    """Refuse a style property that is not a custom one.

    Raises:
        SceneError: If ``name`` does not begin with two dashes.

    """
    if not _PROPERTY.fullmatch(name):
        raise SceneError(
            f"style property {name!r} is not allowed in a scene: only custom "
            "properties are, such as '--dot-size'"
        )


def check_value(tag: str, name: str, value: str) -> None:
    """Refuse a value that refers to another origin or document.

    Raises:
        SceneError: If ``value`` is a URL of another origin, a reference outside this
            document, or an input type that is not allowed.

    """
    if name in ("href", "src"):
        _check_url(tag, value)
    elif name == "type" and tag == "input" and value not in _INPUT_TYPES:
        raise _unknown("input type", value, _INPUT_TYPES)
    elif "url(" in value.lower():
        check_references(name, value)


def check_references(name: str, value: str) -> None:
    """Refuse ``url()`` unless it points to an element of the same document.

    Raises:
        SceneError: If ``value`` has a ``url()`` other than ``url(#id)``.

    """
    if "url(" in _LOCAL_URL.sub("", value).lower():
        raise SceneError(f"{name}={value!r}: only url(#id) is allowed in a scene")


def _check_url(tag: str, value: str) -> None:
    if tag in ("use", "textPath", "linearGradient", "radialGradient", "pattern"):
        if not _LOCAL_HREF.fullmatch(value):
            raise SceneError(f"href={value!r} of {tag}: only '#id' is allowed")
    elif _UNSAFE.search(value) or _SCHEME.match(value):
        raise SceneError(
            f"{value!r} is not allowed as an address in a scene: give one on this "
            "server, such as 'picture.png' or '/static/picture.png'"
        )


def format_number(value: float) -> str:
    """Return ``value`` in the shortest form of SVG, to nine significant digits.

    Raises:
        SceneError: If ``value`` is NaN or infinite.

    """
    if not math.isfinite(value):
        raise SceneError(f"a number in a scene must be finite, got {value}")
    return f"{value:.9g}" if value else "0"


def format_value(name: str, value: Any) -> str | None:
    """Return the text of an attribute, or None if it is to be absent.

    Numbers become short text. True becomes an attribute without a value (``"true"`` for
    ``aria-*`` and ``data-*``), None and False become no attribute. Sequences become the
    form of ``points`` and ``viewBox``: items separated by spaces, pairs by commas.

    Raises:
        SceneError: If ``value`` has a number that is not finite, or has no text form.

    """
    if isinstance(value, str):
        return value
    if value is None:
        return None
    if isinstance(value, bool):
        return _format_bool(name, value)
    if isinstance(value, Iterable) and not isinstance(value, bytes | dict):
        return " ".join(_format_item(name, item) for item in value)
    if hasattr(value, "__float__"):
        return format_number(float(value))
    raise SceneError(f"{name}: cannot make an attribute of {value!r}")


def _format_bool(name: str, value: bool) -> str | None:
    if name in BOOLEAN_ATTRIBUTES:
        return "" if value else None
    return "true" if value else "false"


def _format_item(name: str, item: Any) -> str:
    if isinstance(item, Iterable) and not isinstance(item, str):
        return ",".join(_format_item(name, part) for part in item)
    text = format_value(name, item)
    if text is None:
        raise SceneError(f"{name}: a sequence cannot hold {item!r}")
    return text
