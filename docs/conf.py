"""Configuration of Sphinx; ``make docs`` runs it with ``-n -W``."""

from importlib.metadata import version as installed_version

from sphinx.errors import ExtensionError

import webmap

project = "WebMap"
author = "The WebMap authors"
copyright = "The WebMap authors"
release = version = installed_version("webmap")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
# Sphinx includes safety-figures.md in safety.md; it is no page of its own.
exclude_patterns = ["_build", "safety-figures.md"]

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3

autodoc_default_options = {"show-inheritance": True}
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
napoleon_google_docstring = True
napoleon_numpy_docstring = False

# Every reference to a name of WebMap must resolve. Names of other projects are not
# checked, because each build would have to fetch their inventories.
nitpick_ignore_regex = [
    ("py:.*", r"(?!webmap\b).*"),
    # Types in signatures that programs neither make nor keep.
    ("py:class", r"webmap\.core\.base_page\.(BasePage|PageEntry)"),
    ("py:class", r"webmap\.core\.pictures\.Publisher"),
    ("py:class", r"webmap\.scene\.wire\.session\.SceneSession"),
    ("py:class", r"webmap\.base\.geometry\.(Position|Orientation)"),
    ("py:class", r"webmap\.scene\.(node\.Node|live\.(Live|Rays))"),
    ("py:class", r"webmap(\.\w+)+\.[A-Z]"),  # type variables
]

html_theme = "furo"
html_extra_path = ["images/demo.webp"]  # of the README on a package index
html_title = f"WebMap {release}"

# The public name of each object, by the module and name that define it.
PUBLIC = {
    home.replace(":", "."): f"webmap.{name}" for name, home in webmap._HOMES.items()
}


def lead_to_the_public_name(app, env, node, content):
    """Resolve a reference to the home of a public name, such as in a signature."""
    if node.get("refdomain") != "py":
        return None
    for home, public in PUBLIC.items():
        target = node["reftarget"]
        if target == home or target.startswith(f"{home}."):
            found = public + target.removeprefix(home)
            domain = env.domains.python_domain
            return domain.resolve_xref(
                env, node["refdoc"], app.builder, "obj", found, node, content
            )
    return None


def require_titles(app, env):
    """Fail if a page has no title: the search would list it as ``<no title>``."""
    untitled = [
        name
        for name in sorted(env.found_docs)
        if name not in env.titles or env.titles[name].astext() == "<no title>"
    ]
    if untitled:
        raise ExtensionError(
            f"these pages have no title: {', '.join(untitled)}; begin each with '# ', "
            "or exclude it in docs/conf.py if another page includes it"
        )


def setup(app):
    """Connect the functions above; Sphinx calls this."""
    app.connect("missing-reference", lead_to_the_public_name)
    app.connect("env-check-consistency", require_titles)
