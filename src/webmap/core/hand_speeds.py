"""How fast the hands of one page may drive, by the modules that they drive with."""


class HandSpeeds:
    """The most that each module of a page asks for, and the module the hands are at."""

    def __init__(self) -> None:
        self._most: dict[int, tuple[float, float]] = {}
        self._driving: int | None = None

    @property
    def in_force(self) -> tuple[float, float]:
        """What holds now, in m/s and rad/s.

        That of the module that the hands are at; the least of all while they are at
        none; zero if there is no module that drives.
        """
        if not self._most:
            return (0.0, 0.0)
        if self._driving in self._most:
            return self._most[self._driving]
        linear, angular = zip(*self._most.values(), strict=True)
        return (min(linear), min(angular))

    def set(self, module: object, speed: float, rotation_speed: float) -> None:
        """Note that a module drives, and how fast at the most."""
        self._most[id(module)] = (speed, rotation_speed)

    def drive(self, module: object, on: bool) -> None:
        """Note that the hands are at a module, or left it."""
        if on:
            self._driving = id(module)
        elif self._driving == id(module):
            self._driving = None

    def clear(self, module: object) -> None:
        """Note that a module drives no more."""
        self._most.pop(id(module), None)
        self.drive(module, False)
