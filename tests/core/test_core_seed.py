"""Every row of the table of the names from 2012 is true."""

import inspect
import re
from pathlib import Path

import pytest

import webmap
from webmap.core.extendable import Extendable
from webmap.core.map import Map
from webmap.core.robot import Robot
from webmap.core.world_view import WorldGroup

TABLE = Path(__file__).parents[2] / "docs" / "reference" / "seed.md"
OWNERS = {"map": Map, "robot": Robot, "extendable": Extendable}

NAMES = """
svgns xlinkns generateId extend construct container root world world.tf selected
canvas_width canvas_height onAddRobot onRemoveRobot onSelect getBoundingRect addImage
removeImage addRobot removeRobot setSelected translate scale rotate name map position
orientation angle base_link valid svg onSendTwist onSendMove onOdometryUpdate destroy
setOdometryTopic unsubscribeOdometryTopic setTwistTopic unadvertiseTwistTopic
setMoveTopic unadvertiseMoveTopic twist move addModule removeModule notifyModules
MapViewControl ShowSelected Teleop LaserScanner
"""


def rows():
    """Yield section, old name and new name of each row."""
    section = ""
    for line in TABLE.read_text().splitlines():
        if line.startswith("## "):
            section = line[3:]
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if line.startswith("|") and "---" not in line and cells[1] != "now":
            for new in re.findall(r"`([^`]+)`", cells[1]) or [cells[1]]:
                yield pytest.param(section, cells[0], new, id=f"{section}: {new}")


def test_the_table_contains_every_name_of_the_2012_report():
    named = " ".join(f"{old} " for _, old, _ in (row.values for row in rows()))
    for name in NAMES.split():
        assert re.search(rf"\b{re.escape(name)}\b", named), name


@pytest.mark.parametrize(("section", "old", "new"), list(rows()))
def test_each_new_name_of_the_table_exists_with_its_arguments(section, old, new):
    if new.startswith("class ") or new == "constructor(*args)":
        return  # from Python
    if new == "the same":
        for name in re.findall(r'"(\w+)"', old):
            assert name in webmap.modules.map.namespace
        return
    if new.startswith('"'):
        name = re.match(r'"(\w+)"', new)[1]
        kinds = (webmap.modules.map.namespace, webmap.modules.robot.namespace)
        (factory,) = [kind[name] for kind in kinds if name in kind]
        check_arguments(factory, re.sub(r'^"\w+",?\s*', "", new))
        return
    if new.startswith("on_"):
        check_trigger(section, *re.match(r"(\w+)\((.*)\)", new).groups())
        return
    match = re.fullmatch(r"([\w.]+)(?:\((.*)\))?", new)
    path, arguments = match.groups()
    found = find(path)
    if arguments is not None:
        check_arguments(found, arguments)


def find(path):
    owner, *names = path.split(".")
    if path == "map.world.tf":
        assert "tf" in vars(WorldGroup())
        return None
    if owner in OWNERS:
        (name,) = names
        cls = OWNERS[owner]
        if hasattr(cls, name):
            return getattr(cls, name)
        assert re.search(rf"self\.{name}\b", source_of(cls)), path
        return None
    value = webmap
    for name in names:
        value = getattr(value, name)
    return value


def source_of(cls):
    """Return the source of a class and of its base classes."""
    return "".join(inspect.getsource(each) for each in cls.__mro__[:-1])


def check_arguments(found, arguments):
    wanted = [text.strip() for text in arguments.split(",") if text.strip()]
    has = list(inspect.signature(found).parameters)
    for name in wanted:
        if name != "...":
            assert name in has, f"{found} takes {has}, not {name}"


def check_trigger(section, name, arguments):
    source = source_of(OWNERS[section.lower()])
    count = len([text for text in arguments.split(",") if text.strip()])
    fired = 'f"on_send_{kind}"' if name.startswith("on_send") else f'"{name}"'
    call = re.search(rf"notify_modules\({re.escape(fired)}(.*?)\)", source)
    assert call, f"no code calls the trigger {name}"
    assert call[1].count(",") == count


def test_generated_ids_are_unique_and_contain_webmap_a_random_word_and_a_number():
    made = {webmap.generate_id() for _ in range(1000)}
    assert len(made) == 1000
    assert all(re.fullmatch(r"WebMap-[0-9a-f]{8}-\d+", name) for name in made)


def test_the_svg_and_xlink_namespaces_have_their_standard_urls():
    assert webmap.svg_ns == "http://www.w3.org/2000/svg"
    assert webmap.xlink_ns == "http://www.w3.org/1999/xlink"
