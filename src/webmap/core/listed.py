"""What lists of robots show and group by: tags, and the charge of the battery."""

from collections.abc import Sequence
from typing import Any

from webmap.config.checks import Mistakes
from webmap.config.reading import read
from webmap.config.robot import BATTERY_LOW, RobotConfig
from webmap.core.driven import Driven
from webmap.core.registry import Namespace


class Listed(Driven):
    """A driven object with tags and a battery; base class of every robot.

    Args:
        name: The displayed name.
        namespace: The namespace of its modules.

    """

    def __init__(self, name: str, namespace: Namespace) -> None:
        super().__init__(name, namespace)
        self.tags: tuple[str, ...] = ()
        """Words by which lists group the robot; the first one is its group."""
        self.battery_low = BATTERY_LOW
        """The charge below which the battery is low, from 0 to 1."""

    def set_tags(self, tags: Sequence[str]) -> None:
        """Set the words by which the list of robots is grouped.

        Args:
            tags: The words, such as ``["bay 3"]``; the first one is the group.

        Raises:
            ConfigError: If a tag is no text of one line with at most 100 characters.

        """
        self.tags = tuple(self._checked("tags", tags))

    def set_battery_low(self, charge: float) -> None:
        """Set the charge below which the battery is low.

        Args:
            charge: From 0 to 1; 0 is never low.

        Raises:
            ConfigError: If it is no number from 0 to 1.

        """
        self.battery_low = float(self._checked("battery_low", charge))

    @property
    def charge(self) -> float | None:
        """The least charge of its batteries, from 0 to 1; None if unknown."""
        least: float | None = None
        for module in self.modules:
            charge = getattr(module, "charge", None)
            if isinstance(charge, float) and (least is None or charge < least):
                least = charge
        return least

    def _checked(self, key: str, value: Any) -> Any:
        mistakes = Mistakes()
        config = read(RobotConfig, {"name": self.name, key: value}, (), mistakes)
        mistakes.refuse(f"robot {self.name!r}")
        return getattr(config, key)
