"""What is raised when a command is not taken."""

from webmap.base.errors import MotionError


class Refusal(MotionError):
    """A command that is refused whole: it changes nothing and feeds no dead-man.

    Args:
        why: One sentence for the person who gave the command.
        garbage: Whether the words made no sense, rather than coming at the wrong
            time or from the wrong hand. A page that sends much garbage is closed.

    """

    def __init__(self, why: str, *, garbage: bool = False) -> None:
        super().__init__(why)
        self.why = why
        self.garbage = garbage
