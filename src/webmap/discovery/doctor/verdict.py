"""All findings of the diagnosis, in order."""

from collections import Counter
from collections.abc import Sequence

from webmap.base.outside_text import one_line
from webmap.discovery.doctor.bridge_rules import bridge_findings
from webmap.discovery.doctor.observed import Observed
from webmap.discovery.doctor.robot_rules import robot_findings
from webmap.ros.rosbridge.advice import LEVELS, Finding, Level

MARKS = {"wrong": "WRONG", "warning": "warning", "note": "note", "good": "good"}


def judge(seen: Observed) -> list[Finding]:
    """Return all findings: the bridge first, then each robot, worst first."""
    groups = [list(bridge_findings(seen))]
    groups += [list(robot_findings(one, seen)) for one in seen.findings.robots]
    return [
        finding
        for group in groups
        for finding in sorted(group, key=lambda each: LEVELS.index(each.level))
    ]


def is_ready(findings: Sequence[Finding]) -> bool:
    """Return whether nothing is wrong."""
    return not any(finding.level == "wrong" for finding in findings)


def report(url: str, findings: Sequence[Finding]) -> str:
    """Return the findings for a terminal."""
    lines = [one_line(url)]
    about = ""
    for finding in findings:
        if finding.about != about:
            about = finding.about
            lines += ["", one_line(about)]
        lines.append(f"  {MARKS[finding.level]:<8} {one_line(finding.text)}")
        if finding.advice:
            lines.append(f"           -> {one_line(finding.advice)}")
    counts = Counter(finding.level for finding in findings)
    texts = [_counted(counts[level], level) for level in LEVELS]
    return "\n".join([*lines, "", ", ".join(texts)])


def _counted(count: int, level: Level) -> str:
    """Return the number of findings of a level as text, such as "4 notes"."""
    is_noun = level in ("warning", "note")
    return f"{count} {level}{'s' if is_noun and count != 1 else ''}"
