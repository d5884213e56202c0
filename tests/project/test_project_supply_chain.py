"""Pinned versions and the bill of materials have every package that WebMap needs."""

import json
import re
import tomllib
from itertools import chain
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tools import supply_chain

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
PIN = re.compile(r"([a-z0-9-]+)==([^ ]+) \\\n    --hash=sha256:([0-9a-f]{64})\n")

URN = re.compile(r"urn:uuid:[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")


@pytest.fixture(scope="module")
def sbom():
    return json.loads(json.dumps(supply_chain.sbom()))


def declared(without=frozenset()):
    """Return all requirements of WebMap and its extras, without some of these."""
    extras = PROJECT["optional-dependencies"].items()
    needs = (needed for name, needed in extras if name not in without)
    return [*map(Requirement, chain(PROJECT["dependencies"], *needs))]


def in_image():
    return declared(supply_chain.NOT_IN_IMAGES)


def test_each_package_of_the_image_is_pinned_with_its_hash():
    text = (ROOT / "requirements/image.txt").read_text()
    body = text[text.index("\n", text.rindex("# ")) + 1 :]
    pinned = {name: version for name, version, _ in PIN.findall(body)}
    assert PIN.sub("", body) == "", "a line without a hash"
    assert supply_chain.graph().keys() - {"webmap"} == pinned.keys()
    for need in in_image():
        version = pinned[canonicalize_name(need.name)]
        assert need.specifier.contains(version), f"run make pins: {need}, {version}"


def test_the_bill_of_materials_has_each_package_with_version_and_licence(sbom):
    assert (sbom["bomFormat"], sbom["specVersion"]) == ("CycloneDX", "1.6")
    assert URN.fullmatch(sbom["serialNumber"])
    main, parts = sbom["metadata"]["component"], sbom["components"]
    assert (main["name"], main["version"]) == ("webmap", PROJECT["version"])
    assert main["licenses"] == [{"expression": PROJECT["license"]}]
    names = {part["name"] for part in parts}
    assert names >= {canonicalize_name(need.name) for need in in_image()}
    for part in (main, *parts):
        assert part["purl"] == f"pkg:pypi/{part['name']}@{part['version']}"
        assert part["licenses"], f"{part['name']} has no licence"
    assert len({part["bom-ref"] for part in (main, *parts)}) == len(parts) + 1


def test_the_bill_of_materials_states_which_package_needs_which(sbom):
    refs = {part["bom-ref"] for part in sbom["components"]}
    refs.add(sbom["metadata"]["component"]["bom-ref"])
    needs = {each["ref"]: set(each["dependsOn"]) for each in sbom["dependencies"]}
    assert needs.keys() == refs
    assert set().union(*needs.values()) <= refs
    reached, todo = set(), [sbom["metadata"]["component"]["bom-ref"]]
    while todo:
        one = todo.pop()
        if one not in reached:
            reached.add(one)
            todo += needs[one]
    assert reached == refs, "a package that nothing needs"


def test_each_direct_dependency_is_argued_and_there_are_at_most_twelve():
    assert len(PROJECT["dependencies"]) <= 12
    page = (ROOT / "docs/explanation/dependencies.md").read_text().lower()
    for need in declared():
        assert f"[{need.name.lower()}](" in page, need.name
