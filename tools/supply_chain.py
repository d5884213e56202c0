"""Write what WebMap installs: ``requirements/image.txt`` and an SBOM.

``pins`` asks pip which versions it would install now, with all extras of an image, and
writes them with their hashes. They are those for this system and this version of
Python::

    pip install --require-hashes -r requirements/image.txt
    pip install --no-deps webmap

``sbom`` writes a bill of materials (CycloneDX 1.6, JSON) of what is installed here.
"""

import json
import subprocess
import sys
import uuid
from importlib.metadata import Distribution, distribution
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PINS = ROOT / "requirements/image.txt"

HEAD = f"""\
# Every package that an image of WebMap has, with its extras. Made by "make pins" for
# {sys.platform} with Python {sys.version_info.major}.{sys.version_info.minor}.
"""

NOT_IN_IMAGES = {"notebook"}
"""Extras that an image does not need: it serves pages and has no notebook."""


def extras() -> list[str]:
    """Return the names of WebMap's extras in an image."""
    names = distribution("webmap").metadata.get_all("Provides-Extra") or []
    return sorted(set(names) - NOT_IN_IMAGES)


def graph() -> dict[str, set[str]]:
    """Return each installed package that WebMap needs, with those that it needs."""
    found: dict[str, set[str]] = {}
    todo = [("webmap", ("", *extras()))]
    seen = set(todo)
    while todo:
        name, wanted = todo.pop()
        needs = found.setdefault(name, set())
        for text in distribution(name).requires or ():
            need = Requirement(text)
            marker = need.marker
            if marker and not any(marker.evaluate({"extra": one}) for one in wanted):
                continue
            other = (canonicalize_name(need.name), ("", *sorted(need.extras)))
            needs.add(other[0])
            if other not in seen:
                seen.add(other)
                todo.append(other)
    return found


def licences(package: Distribution) -> list[dict[str, Any]]:
    """Return the licence of a package, as its metadata states it."""
    about = package.metadata
    for expression in about.get_all("License-Expression") or []:
        return [{"expression": expression}]
    classifiers = about.get_all("Classifier") or []
    names = [one.rpartition(" :: ")[2] for one in classifiers if "License ::" in one]
    texts = [one for one in about.get_all("License") or [] if "\n" not in one]
    return [{"license": {"name": name}} for name in names or texts]


def sbom() -> dict[str, Any]:
    """Return the bill of materials of what is installed here."""
    found = graph()
    parts = {name: _component(name) for name in sorted(found)}
    main = {**parts.pop("webmap"), "type": "application"}
    text = json.dumps([main, *parts.values()])
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, text)}",
        "version": 1,
        "metadata": {"component": main},
        "components": list(parts.values()),
        "dependencies": [
            {"ref": _ref(name), "dependsOn": sorted(map(_ref, found[name]))}
            for name in sorted(found)
        ],
    }


def _ref(name: str) -> str:
    return f"pkg:pypi/{name}@{distribution(name).version}"


def _component(name: str) -> dict[str, Any]:
    package = distribution(name)
    return {
        "type": "library",
        "bom-ref": _ref(name),
        "name": name,
        "version": package.version,
        "purl": _ref(name),
        "licenses": licences(package),
    }


def pins() -> str:
    """Return all packages with versions and hashes, as pip would install them now."""
    report = subprocess.run(
        [
            *(sys.executable, "-m", "pip", "install", "--quiet", "--dry-run"),
            *("--ignore-installed", "--only-binary", ":all:", "--report", "-"),
            f"{ROOT}[{','.join(extras())}]",
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    lines = []
    for each in json.loads(report.stdout)["install"]:
        name = canonicalize_name(each["metadata"]["name"])
        if name != "webmap":
            hashes = each["download_info"]["archive_info"]["hashes"]
            version = each["metadata"]["version"]
            lines.append(
                f"{name}=={version} \\\n    --hash=sha256:{hashes['sha256']}\n"
            )
    return HEAD + "".join(sorted(lines))


def main() -> None:
    """Write the pins, or the bill of materials to the given file."""
    if sys.argv[1] == "pins":
        PINS.parent.mkdir(exist_ok=True)
        PINS.write_text(pins(), encoding="utf-8")
    else:
        file = Path(sys.argv[2])
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(sbom(), indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
