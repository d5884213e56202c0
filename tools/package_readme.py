"""The README of the package: hatchling calls this when it builds WebMap.

Links in ``README.md`` are relative, so that they work in a checkout. A package index
has only this one file, so there they lead to the published documentation.
"""

import re
from pathlib import Path

from hatchling.metadata.plugin.interface import MetadataHookInterface

LINK = re.compile(r"(?<=\]\()(?![a-z]+:|#)([^)#]+)")
"""The target of a relative link or picture in Markdown."""

ELSEWHERE = {
    "CONTRIBUTING.md": "project/contributing.html",
    "examples": "tutorial/index.html",
}
"""The page of each target outside the folder ``docs``."""


def with_absolute_links(text: str, site: str) -> str:
    """Return the README with links to the pages and files of a site.

    Args:
        text: The README, in Markdown.
        site: The address of the documentation, with a slash at its end.

    """

    def absolute(link: re.Match[str]) -> str:
        page = link[0].removeprefix("docs/")
        if page.startswith("images/"):
            return site + page.removeprefix("images/")
        return site + ELSEWHERE.get(link[0], re.sub(r"\.md$", ".html", page))

    return LINK.sub(absolute, text)


class PackageReadme(MetadataHookInterface):
    """Sets the description of the package."""

    def update(self, metadata: dict) -> None:  # type: ignore[type-arg]
        """Set ``readme`` in the metadata of the project."""
        text = (Path(self.root) / "README.md").read_text("utf-8")
        site = f"{metadata['urls']['Documentation']}/en/latest/"
        metadata["readme"] = {
            "content-type": "text/markdown",
            "text": with_absolute_links(text, site),
        }
