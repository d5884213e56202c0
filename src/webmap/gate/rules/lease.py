"""Leases: who may move a machine, and the number that outdates all earlier ones."""

import secrets
from dataclasses import dataclass
from typing import Literal

from webmap.gate.refusal import Refusal


@dataclass(frozen=True, slots=True)
class Lease:
    """The right of one connection to move one machine."""

    connection: str
    name: str
    """Who that is, for people."""
    epoch: int
    program: bool = False
    """Whether a program holds it; any operator may take it from one."""


class Epochs:
    """Numbers for leases, each larger than the one before.

    They start at a random number, so that a command of an earlier session of the
    gate cannot meet a lease of this one.
    """

    def __init__(self, first: int | None = None) -> None:
        self._next = secrets.randbits(31) if first is None else first

    def next(self) -> int:
        """Return the next number."""
        self._next += 1
        return self._next


def check_take(
    lease: Lease | None, role: Literal["viewer", "operator", "admin"], program: bool
) -> None:
    """Let somebody who holds no lease on a machine take it, or not.

    Args:
        lease: The lease that there is now, of another connection.
        role: The role of the one who asks.
        program: Whether a program asks.

    Raises:
        Refusal: If the machine is not to be had.

    """
    check_role(role)
    if lease is None or (lease.program and not program):
        return
    raise Refusal(f"{lease.name or lease.connection} has control")


def check_lease(lease: Lease | None, connection: str, epoch: int) -> None:
    """Let the holder of the lease pass, under the lease's own epoch.

    Raises:
        Refusal: If somebody else holds it, or nobody, or the epoch is another.

    """
    if lease is None:
        raise Refusal("nobody has control: take control first")
    if lease.connection != connection:
        raise Refusal(f"{lease.name or lease.connection} has control")
    if lease.epoch != epoch:
        raise Refusal(
            f"got epoch {epoch}, expected {lease.epoch}, the epoch of the lease"
        )


def check_role(role: Literal["viewer", "operator", "admin"]) -> None:
    """Let operators and administrators pass.

    Raises:
        Refusal: If ``role`` is that of a viewer.

    """
    if role == "viewer":
        raise Refusal("viewers can only look and press STOP; driving needs an operator")
