"""How Sphinx builds this documentation; ``make docs`` calls it with ``-n -W``."""

from importlib.metadata import version as installed_version

project = "WebMap"
author = "The WebMap authors"
copyright = "The WebMap authors"
release = version = installed_version("webmap")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3

autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
napoleon_google_docstring = True
napoleon_numpy_docstring = False

# Every reference to a name of ours has to lead somewhere. Names of others are not
# checked, because their inventories would have to be fetched for each build.
nitpick_ignore_regex = [("py:.*", r"(?!webmap\b).*")]

html_theme = "furo"
html_title = f"WebMap {release}"
