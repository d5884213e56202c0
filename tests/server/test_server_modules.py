"""The modules and style sheets of WebMap that browsers receive."""

import gzip
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from webmap.server.bundles import (
    EAGER,
    FIRST_PARTS,
    FIRST_SHEETS,
    IN_PAGE,
    LATER,
    LATER_PARTS,
    PART_FOLDERS,
    PART_SHEETS,
    PARTS,
    STARTS,
    served_modules,
    served_sheets,
    shortened,
)
from webmap.server.own_files import FOLDERS, PACKAGE

HERE = Path(__file__).parent

OBJECT = "$modules"
"""The name of the object with which modules refer to each other."""


def own_files(suffix: str) -> dict[str, str]:
    return {
        path.relative_to(PACKAGE).as_posix(): path.read_text("utf-8")
        for folder in FOLDERS
        for path in (PACKAGE / folder).rglob(f"*{suffix}")
    }


@pytest.fixture(scope="module")
def read():
    """Parse all modules with a JavaScript parser, as written and as served."""
    sources = own_files(".js")
    served = served_modules(sources)
    given = {
        "pairs": {name: [text, shortened(text)] for name, text in sources.items()},
        "modules": {name: text for name, text in served.items() if name in sources},
    }
    written = {f"written {name}": text for name, text in sources.items()}
    given["modules"] |= written | {PARTS: served[PARTS]}
    node = shutil.which("node")
    assert node, "node is needed to test the browser's modules"
    done = subprocess.run(
        [node, HERE / "served_tokens.mjs"],
        input=json.dumps(given),
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout)


def test_only_comments_and_indentation_are_left_out_and_lines_keep_their_numbers(read):
    assert read["different"] == []
    sources = own_files(".js").values()
    left = sum(len(shortened(text)) for text in sources)
    assert left < 0.7 * sum(map(len, sources))


def test_each_module_has_the_same_exports_as_its_source(read):
    exported = read["exported"]
    for name in own_files(".js"):
        names = [one for one in exported[name] if one != OBJECT]
        assert sorted(names) == sorted(exported[f"written {name}"]), name


def test_each_module_of_webmap_is_served_once_and_a_page_starts_with_few():
    sources = own_files(".js")
    served = served_modules(sources)
    in_page = served.pop(IN_PAGE)
    texts = {name: text for name, text in served.items() if name.endswith(".js")}
    for name in sources:
        where = [key for key, text in texts.items() if f'["{name}"] ??= (' in text]
        assert len(where) == 1, name
    loaded, todo = set(), list(STARTS)
    while todo:
        name = todo.pop()
        loaded.add(name)
        for address in re.findall(r' await import\("(.+)"\);$', texts[name], re.M):
            needed = (PACKAGE / name).parent.joinpath(address).resolve()
            todo.append(needed.relative_to(PACKAGE).as_posix())
    assert loaded == set(STARTS)
    assert len(STARTS) == 3
    first = re.findall(r'^\$modules\["(.+)"\] \?\?= ', in_page, re.M)
    assert first == re.findall(r'^\$modules\["(.+)"\] \?\?= ', texts[STARTS[0]], re.M)


def test_chromium_compiles_whole_bundles_beside_the_main_thread():
    served = served_modules(own_files(".js"))
    for name in (*STARTS, PARTS, LATER):
        assert served[name].startswith("//# allFunctionsCalledOnLoad\n"), name
    assert not served["web/tools/elements.js"].startswith(EAGER)


def test_the_bundle_of_the_first_picture_has_no_inputs_commands_and_layouts():
    text = served_modules(own_files(".js"))["web/page.js"]
    names = re.findall(r'^\$modules\["(.+)"\] \?\?= ', text, re.M)
    assert "web/scene.js" in names
    later = ("web/inputs/", "web/motion/", "web/layout.js", "features/")
    assert not [name for name in names if name.startswith(later)]
    assert len(gzip.compress(text.encode())) < 29_000


def test_a_source_map_has_the_source_of_each_line():
    sources = own_files(".js")
    served = served_modules(sources)
    found = 0
    for name, text in served.items():
        if not name.endswith(".map"):
            continue
        lines = served[name.removesuffix(".map")].split("\n")
        for section in json.loads(text)["sections"]:
            (source,) = section["map"]["sourcesContent"]
            (address,) = section["map"]["sources"]
            origin = (PACKAGE / name).parent.joinpath(address).resolve()
            assert sources[origin.relative_to(PACKAGE).as_posix()] == source
            written, start = source.split("\n"), section["offset"]["line"]
            assert len(section["map"]["mappings"].split(";")) == len(written)
            for line, served_line in zip(written, lines[start:], strict=False):
                changed = re.search(
                    r"^(import |export |  \w+( as \w+)?,$|} from )| import\(", line
                )
                assert served_line in ("", line, line.lstrip()) or changed, (
                    origin,
                    line,
                )
            found += 1
    assert found == len(sources)


FEW = {
    "start.js": 'import { a, b as c } from "./both.js";\nexport const page = a + c;\n',
    "both.js": "/** Two. */\nexport const a = 1;\nexport function b() {}\n",
    "x/one.js": 'import { b } from "../both.js";\n'
    'import { own } from "./own.js";\n'
    'import { tool } from "../tool.js";\n'
    "export default function attach() {}\n",
    "x/own.js": 'import {\n  a,\n  b as c,\n} from "../both.js";\n'
    "// Own.\nexport class own {}\n",
    "x/two.js": 'import { tool } from "../tool.js";\nexport default class Two {\n'
    '  later() {\n    return import("./used.js");\n  }\n}\n',
    "x/used.js": 'import { tool } from "../tool.js";\n'
    'import { own } from "./only.js";\nexport class Used {}\n',
    "x/only.js": "export const own = 3;\n",
    "tool.js": "export async function tool() {}\n",
}


def test_modules_that_a_page_does_not_start_with_are_served_as_one():
    served = served_modules(FEW, ["start.js"])
    assert served[PARTS] == EAGER + (
        "const $modules = (globalThis.$modules ??= {});\n"
        'if (!$modules["start.js"]) await import("./start.js");\n'
        '$modules["x/own.js"] ??= (() => {\n'
        'const {\na,\nb: c,\n} = $modules["both.js"];\n'
        "\nclass own {}\n"
        "\nreturn { own };\n})();\n"
        '$modules["tool.js"] ??= (() => {\n'
        "async function tool() {}\n"
        "\nreturn { tool };\n})();\n"
        '$modules["x/one.js"] ??= (() => {\n'
        'const { b } = $modules["both.js"];\n'
        'const { own } = $modules["x/own.js"];\n'
        'const { tool } = $modules["tool.js"];\n'
        "function attach() {}\n"
        "\nreturn { default: attach };\n})();\n"
        '$modules["x/two.js"] ??= (() => {\n'
        'const { tool } = $modules["tool.js"];\nclass Two {\nlater() {\n'
        'return $modules["web/browser_parts.js"].laterModule("x/used.js");\n}\n}\n'
        "\nreturn { default: Two };\n})();\n"
        "export { $modules };\n"
        "//# sourceMappingURL=parts.js.map\n"
    )


def test_what_is_imported_when_it_is_used_is_served_with_what_only_this_imports():
    served = served_modules(FEW, ["start.js"])
    assert served[LATER] == EAGER + (
        "const $modules = (globalThis.$modules ??= {});\n"
        'if (!$modules["parts.js"]) await import("./parts.js");\n'
        '$modules["x/only.js"] ??= (() => {\n'
        "const own = 3;\n"
        "\nreturn { own };\n})();\n"
        '$modules["x/used.js"] ??= (() => {\n'
        'const { tool } = $modules["tool.js"];\n'
        'const { own } = $modules["x/only.js"];\n'
        "class Used {}\n"
        "\nreturn { Used };\n})();\n"
        "export { $modules };\n"
        "//# sourceMappingURL=later.js.map\n"
    )


def test_the_settings_of_gamepads_pictures_and_recordings_come_when_they_are_used():
    text = served_modules(own_files(".js"))[LATER]
    assert set(re.findall(r'^\$modules\["(.+)"\] \?\?= ', text, re.M)) == {
        "features/drive/gamepad_panel.js",
        "features/export/export_copy.js",
        "features/export/export_picture.js",
        "features/player/player_bar.js",
        "features/player/player_position.js",
    }


def test_the_address_of_a_module_within_another_has_the_same_exports():
    served = served_modules(FEW, ["start.js"])
    assert served["both.js"] == (
        'import { $modules } from "./start.js";\n'
        'export const { a, b } = $modules["both.js"];\n'
    )
    assert served["x/own.js"] == (
        'import { $modules } from "../parts.js";\n'
        'export const { own } = $modules["x/own.js"];\n'
    )
    assert served["x/one.js"] == (
        'import { $modules } from "../parts.js";\n'
        'export default $modules["x/one.js"].default;\n'
    )
    assert set(served) - set(FEW) == {
        PARTS,
        PARTS + ".map",
        LATER,
        LATER + ".map",
        IN_PAGE,
        "start.js.map",
    }


def test_a_text_in_backticks_keeps_its_indentation():
    text = "  const a = `\n    b\n  ${c}`;\n  // no\n    d(`e`);\n\tf();\n"
    assert shortened(text) == "  const a = `\n    b\n  ${c}`;\n\nd(`e`);\nf();\n"


def test_a_module_is_one_instance_for_users_and_in_a_bundle_that_is_loaded_twice(
    tmp_path,
):
    for name, text in served_modules(FEW, ["start.js"]).items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "package.json").write_text('{"type": "module"}')
    (tmp_path / "user.js").write_text(
        'import { own } from "./x/own.js";\n'
        'const loads = ["./parts.js", "./parts.js?again=1"].map((at) => import(at));\n'
        "for (const { $modules } of await Promise.all(loads)) {\n"
        '  console.log($modules["x/own.js"].own === own);\n'
        "}\n"
    )
    node = shutil.which("node")
    assert node, "node is needed to test the browser's modules"
    done = subprocess.run(
        [node, tmp_path / "user.js"], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["true", "true"]


def declared():
    """Return the modules and style sheets of all browser parts in Python."""
    texts = [path.read_text("utf-8") for path in PACKAGE.rglob("*.py")]
    return {
        name
        for text in texts
        if "add_browser_part" in text
        for name in re.findall(r'"((?:features|console|web)/[\w/]+\.(?:js|css))"', text)
    }


def test_all_declared_browser_parts_are_served_with_their_styles():
    modules = served_modules(own_files(".js"))
    sheets = served_sheets(own_files(".css"))
    names = declared()
    assert len(names) > 30
    for name in names:
        if name.endswith(".js"):
            assert name.startswith(PART_FOLDERS), name
            usual = LATER if name in LATER_PARTS else PARTS
            bundle = modules[FIRST_PARTS.get(name, usual)]
            assert f'$modules["{name}"] ??= (' in bundle, name
        else:
            first = name.removesuffix(".css") + ".js" in FIRST_PARTS
            own = re.sub("@import.*", "", sheets[name]).strip()
            assert own in sheets[FIRST_SHEETS if first else PART_SHEETS], name
    for name in (FIRST_SHEETS, PART_SHEETS):
        assert sheets[name].count("@import") == 1


@pytest.mark.parametrize(
    "line",
    [
        'import "./both.js";',
        'import * as all from "./both.js";',
        'import one from "./both.js";',
        'import { a } from "https://example.com/x.js";',
        'export * from "./both.js";',
        "export let a = 1;",
        "export { a };",
        "export const { a } = {};",
        "export default 1;",
        'import { a } from "./gone.js";',
        'const a = () => import("./gone.js");',
        'import { own } from "./a.js";',
    ],
)
def test_a_module_of_another_form_is_refused(line):
    with pytest.raises(ValueError, match=r"a\.js (has an|imports)"):
        served_modules({**FEW, "a.js": line + "\n"}, ["start.js"])


def test_a_style_sheet_is_served_with_those_that_it_imports():
    sheets = {
        "base.css": "/* All. */\nb{}\n",
        "x/a.css": '/* A. */\n@import url("../base.css");\n'
        '@import url("own/c.css");\na{}\n',
        "x/own/c.css": "c{}\n",
        "x/d.css": '@import url("a.css");\n@import url("own/c.css");\nd{}\n',
    }
    served = served_sheets(sheets, shared="other.css")
    assert served["x/d.css"].split() == ["b{}", "c{}", "a{}", "c{}", "d{}"]
    del sheets["x/d.css"]
    served = served_sheets(sheets, shared="base.css")
    lines = ['@import url("../base.css");', "c{}", "a{}"]
    assert served["x/a.css"].splitlines() == lines


@pytest.mark.parametrize(
    "text",
    ['b{}\n@import url("base.css");\n', '@import url("c.css") screen;\nb{}\n'],
)
def test_a_style_sheet_with_an_import_of_another_form_is_refused(text):
    with pytest.raises(ValueError, match=r"a\.css"):
        served_sheets({"a.css": text, "base.css": "", "c.css": ""}, shared="base.css")


def test_the_style_sheets_of_webmap_import_one_at_most():
    for text in served_sheets(own_files(".css")).values():
        assert text.count("@import") <= 1
