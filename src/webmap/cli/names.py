"""Names of robots as people write them: fit for a list, and no two of them alike."""

from webmap.discovery.naming import LONGEST, is_name
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
