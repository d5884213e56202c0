"""How a fleet file lays maps onto the common one."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from webmap.cli.fleet import checks
from webmap.cli.fleet.checks import Check, Mistakes
from webmap.cli.fleet.lines import Path
from webmap.core.alignment import align_bridge, numbers
from webmap.core.alignment import alignment as checked
from webmap.core.alignment_store import store
from webmap.errors import ConfigError

if TYPE_CHECKING:
    from webmap import Bridge, Robot

Alignment = tuple[float, float, float]
"""Metres, metres, and degrees counter-clockwise."""


def alignment(value: Any) -> Alignment:
    """Take where the origin of a map lies on the common one."""
    try:
        return numbers(checked(*value))
    except (ConfigError, TypeError):
        raise ConfigError(
            "x and y in metres and an angle in degrees, counter-clockwise, such as "
            "[12.5, -3.0, 90.0]"
        ) from None


def bridge_table(
    value: dict[str, Any], address: Check, path: Path, mistakes: Mistakes
) -> tuple[str, Alignment | None]:
    """Return the address of a bridge that has a table, and its alignment."""
    known: dict[str, Check] = {"url": address, "alignment": alignment}
    meant = checks.table(value, known, path, mistakes, needed=("url",))
    return meant.get("url") or "", meant.get("alignment")


def align_bridges(
    stated: Mapping[str, Alignment], bridges: Mapping[str, "Bridge"]
) -> None:
    """Align bridges as a file says."""
    for name, place in stated.items():
        align_bridge(bridges[name], *place)


def restore(robots: "list[Robot]") -> None:
    """Align robots as people did on a page, where the file says nothing newer."""
    for robot in robots:
        store.restore(robot)
