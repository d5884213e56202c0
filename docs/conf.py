"""How Sphinx builds this documentation; ``make docs`` calls it with ``-n -W``."""

from importlib.metadata import version as installed_version

import webmap

project = "WebMap"
author = "The WebMap authors"
copyright = "The WebMap authors"
release = version = installed_version("webmap")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3

autodoc_default_options = {"show-inheritance": True}
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
napoleon_google_docstring = True
napoleon_numpy_docstring = False

# Every reference to a name of ours has to lead somewhere. Names of others are not
# checked, because their inventories would have to be fetched for each build.
nitpick_ignore_regex = [
    ("py:.*", r"(?!webmap\b).*"),
    # Types in signatures that nobody makes or holds.
    ("py:class", r"webmap\.core\.page\.PageEntry"),
    ("py:class", r"webmap\.core\.pictures\.Publisher"),
    ("py:class", r"webmap\.wire\.session\.SceneSession"),
    ("py:class", r"webmap\.core\.given_pose\.(Position|Orientation)"),
    ("py:class", r"webmap\.scene\.(node\.Node|live\.Live)"),
    ("py:class", r"webmap(\.\w+)+\.[A-Z]"),  # type variables
]

html_theme = "furo"
html_title = f"WebMap {release}"

# Where the public names live, by the place in which they are documented.
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


def setup(app):
    """Connect the above; Sphinx calls this."""
    app.connect("missing-reference", lead_to_the_public_name)
