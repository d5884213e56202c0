from urllib.parse import urljoin

import pytest

from webmap.server.bundles import STARTS
from webmap.server.html import (
    EARLY,
    NEXT,
    base_from,
    make_page,
    prepare_page,
    relative,
)

OPENING = "opening;"
NEXT_LINKS = "".join(f'<link rel="{NEXT}" href="./_webmap/{n}">' for n in STARTS[2:])
FIRST, PAGE = (
    f'<link rel="modulepreload" href="./_webmap/{name}">' for name in STARTS[:2]
)
CSS = '<link rel="stylesheet" href="./_webmap/web/webmap.css">'
SHEET = NEXT_LINKS + FIRST + CSS + PAGE
EARLY_SCRIPT = f'<script data-from="./_webmap/{STARTS[0]}">{OPENING}</script>'
SCRIPTS = [
    f'<script type="module" src="./_webmap/{name}"></script>' for name in STARTS[:2]
]
SCRIPT = "".join(SCRIPTS)
ICON = '<link rel="icon" href="./_webmap/icon.svg" type="image/svg+xml">'


def test_a_made_page_has_one_container_and_an_escaped_title():
    text = make_page("A <b>", base_from("/"), OPENING)
    assert '<div id="webmap_container"></div>' in text
    assert "<title>A &lt;b&gt;</title>" in text
    assert f"</title>{NEXT_LINKS}{EARLY_SCRIPT}\n<link" in text
    assert f"{PAGE}{SCRIPTS[1]}\n</head>" in text


def test_a_made_page_is_resized_by_an_on_screen_keyboard():
    assert "interactive-widget=resizes-content" in make_page(
        "A", base_from("/"), OPENING
    )


@pytest.mark.parametrize(
    ("path", "base"),
    [
        ("/", "./_webmap/"),
        ("/lab", "./_webmap/"),
        ("/lab/", "./../_webmap/"),
        ("/a/b/c", "./../../_webmap/"),
    ],
)
@pytest.mark.parametrize("prefix", ["", "/robots", "/user/x/proxy/8080"])
def test_the_base_url_is_relative_so_that_it_fits_under_every_prefix(
    path, base, prefix
):
    assert base_from(path) == base
    page = f"http://host{prefix}{path}"
    assert urljoin(page, base) == f"http://host{prefix}/_webmap/"


@pytest.mark.parametrize("to", ["//evil.example", "https://evil.example", "", "/?a=1"])
def test_a_relative_url_stays_on_the_server(to):
    for path in ("/", "/lab", "/_webmap/sign-in"):
        url = urljoin(f"http://host{path}", relative(path, to))
        assert url.startswith("http://host/")


def test_style_sheets_of_the_user_come_after_webmap_css_and_before_the_script():
    text = '<html><head><link rel="stylesheet" href="a.css"></head><body></body></html>'
    assert prepare_page(text, base_from("/"), OPENING).text == (
        f'<html><head>{SHEET}<link rel="stylesheet" href="a.css">{SCRIPT}{ICON}</head>'
        "<body></body></html>"
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", f"{SHEET}{SCRIPT}{ICON}"),
        ("<p>hello", f"{SHEET}{SCRIPT}{ICON}<p>hello"),
        ("<!doctype html>\n<p>é", f"<!doctype html>\n{SHEET}{SCRIPT}{ICON}<p>é"),
        ("<html><body>x", f"<html>{SHEET}{SCRIPT}{ICON}<body>x"),
        (
            "<!-- <head> -->\r\n<HEAD lang=en>\r\n<title></head></title>\r\n</HEAD >",
            f"<!-- <head> -->\r\n<HEAD lang=en>{SHEET}\r\n<title></head></title>\r\n"
            f"{SCRIPT}{ICON}</HEAD >",
        ),
        (
            "<head><title>x</title><body><header>",
            f"<head>{SHEET}<title>x</title>{SCRIPT}{ICON}<body><header>",
        ),
    ],
)
def test_html_of_every_form_gets_the_style_sheet_the_script_and_the_icon(
    text, expected
):
    assert prepare_page(text, base_from("/"), OPENING).text == expected


def test_files_that_the_html_already_loads_are_not_added_again():
    text = (
        '<head><link rel="stylesheet" href="_webmap/web/webmap.css">'
        '<link rel="shortcut icon" href="me.png">'
        '<script type="module" src="_webmap/web/page.js"></script></head>'
    )
    own = prepare_page(text, base_from("/"), OPENING).text
    assert own == text.replace("<head>", f"<head>{NEXT_LINKS}{FIRST}{PAGE}")


def test_a_page_may_open_its_socket_before_its_style_sheets_are_there():
    text = f'<head><link rel="stylesheet" href="a.css">{EARLY}</head>'
    own = prepare_page(text, base_from("/"), OPENING)
    assert own.blocked == []
    assert own.text == (
        f"<head>{NEXT_LINKS}{EARLY_SCRIPT}{CSS}{PAGE}"
        f'<link rel="stylesheet" href="a.css">{SCRIPTS[1]}{ICON}</head>'
    )


def test_own_files_of_webmap_that_the_html_loads_get_the_address_of_their_version():
    text = (
        '<head><link rel="stylesheet" href="../_webmap/web/style/controls.css">\n'
        '<link rel="stylesheet" href="web/own.css"></head>'
        '<body data-x="_webmap/web/"><img src="_webmap/files/x/y.png">'
        '<script src="/_webmap/features/x.js"></script>'
    )
    own = prepare_page(text, base_from("/a/") + "v-12/", OPENING).text
    assert 'href="../_webmap/v-12/web/style/controls.css">\n' in own
    assert '<link rel="stylesheet" href="web/own.css">' in own
    assert '<body data-x="_webmap/web/">' in own
    assert '<img src="_webmap/files/x/y.png">' in own
    assert own.endswith('<script src="/_webmap/v-12/features/x.js"></script>')


def test_content_blocked_by_the_policy_is_named_with_its_line():
    page = prepare_page(
        "<head>\n<style>a{}</style>\n<script>x()</script>\n"
        '<script type="application/json">{}</script>\n'
        '<script src="https://cdn.example.com/x.js"></script>\n'
        '<img src="//example.com/x.png">\n</head>\n'
        '<body onload="x()">\n<p style="color:red">\n<a href="https://ros.org">',
        base_from("/"),
        OPENING,
    )
    assert [sentence.partition(" is blocked")[0] for sentence in page.blocked] == [
        "line 2: an inline style",
        "line 3: an inline script",
        "line 5: 'https://cdn.example.com/x.js'",
        "line 6: '//example.com/x.png'",
        "line 8: a handler in an attribute",
        "line 9: an inline style",
    ]
