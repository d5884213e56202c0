"""Names of robots as people write them: fit for a list, and no two of them alike."""

from webmap.discovery.naming import LONGEST, is_name, same_name
from webmap.errors import ConfigError

APART = "names differ by more than case and Unicode form"


def check_name(name: str, where: str) -> None:
    """Refuse a name that cannot stand in a list.

    Raises:
        ConfigError: If it has more than a line, or is very long.

    """
    if not is_name(name):
        raise ConfigError(
            f"{where}: a name is one line of {LONGEST} characters at the most"
        )


def set_twice(name: str) -> ConfigError:
    """Return the refusal of a ``--set`` by which two robots would have one name."""
    return ConfigError(f"--set: two robots would be called {name!r}; {APART}")


def free_name(wanted: str, taken: set[str]) -> str:
    """Return a name that nobody has, and take it.

    Args:
        wanted: What a number is put behind, if need be.
        taken: What :func:`webmap.discovery.naming.same_name` makes of each name.

    """
    name, number = wanted, 1
    while same_name(name) in taken:
        number += 1
        name = f"{wanted} {number}"
    taken.add(same_name(name))
    return name
