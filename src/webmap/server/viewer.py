"""Who looks at a page."""

from dataclasses import dataclass
from typing import Literal

Role = Literal["viewer", "operator", "admin"]


@dataclass(frozen=True, slots=True)
class Viewer:
    """One browser that has signed in; all its pages and tabs are one viewer."""

    id: str
    """Opaque, the same for as long as the browser stays signed in."""

    name: str
    """What other people read when this viewer drives."""

    role: Role = "operator"
    """What the viewer may do: look, drive, or administer."""
