"""Who this process is for a Zenoh router, from its environment."""

import os
import secrets
from typing import Self

from webmap.agents.address import ANYONE, checked_name


class RouterUser:
    """Who this process is for the router.

    Args:
        name: The name of the user; "" without users.
        password: The password.
        ca: The file with the certificate of the authority that signed the router's, if
            the system does not know it.

    """

    def __init__(self, name: str = "", password: str = "", ca: str = "") -> None:
        self.name = checked_name(name, "user of the router") if name else ANYONE
        self.instance = secrets.token_hex(4)
        self.password = password
        self.ca = ca

    @property
    def may_not(self) -> str:
        """What to add where no agent is found: a router shows it only to its users."""
        return (
            "" if self.name == ANYONE else f", or the user {self.name} may not see it"
        )

    @property
    def refusal(self) -> str:
        """Why what answers at the router's address may not let this process in."""
        if self.name == ANYONE:
            return (
                "it lets nobody in without a user: set WEBMAP_ROUTER_USER and "
                "WEBMAP_ROUTER_PASSWORD, or it is not a Zenoh router"
            )
        return (
            f"it does not let the user {self.name} in: the name or the password is "
            "wrong, it has no users, or it is not a Zenoh router"
        )

    @classmethod
    def from_environment(cls) -> Self:
        """Return the user of the variables ``WEBMAP_ROUTER_...``."""
        names = ("USER", "PASSWORD", "CA")
        return cls(*(os.environ.get(f"WEBMAP_ROUTER_{name}", "") for name in names))
