"""Which connections wait without a sign-in, and which of them must go: without I/O."""

import ipaddress
from typing import Generic, TypeVar

T = TypeVar("T")


class Waiting(Generic[T]):
    """Connections that serve nobody who has signed in: so many, the newest stay.

    A newcomer is never refused: whether it has signed in is known only when its request
    has come. So the oldest one goes, of the address that has the most, and one address
    cannot push those of another out.

    Args:
        limit: How many wait at most.
        per_address: How many of one address wait at most. This does not apply to this
            machine's own: a reverse proxy or a tunnel here brings everybody.

    """

    def __init__(self, limit: int, per_address: int) -> None:
        self._limit = limit
        self._per_address = per_address
        # The oldest first; a dict, as it keeps its order and finds each at once.
        self._by_address: dict[str, dict[T, None]] = {}
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def add(self, connection: T, address: str) -> T | None:
        """Let a connection wait.

        Args:
            connection: One that does not wait.
            address: Where it comes from, as :func:`origin_of` gives it.

        Returns:
            One that must go for it, and that does not wait any more.

        """
        mine = self._by_address.setdefault(address, {})
        gone = None
        if address and len(mine) >= self._per_address:
            gone = self._oldest(address)
        elif self._count >= self._limit:
            gone = self._oldest(max(self._by_address, key=self._number_of))
        self._by_address.setdefault(address, {})[connection] = None
        self._count += 1
        return gone

    def remove(self, connection: T, address: str) -> None:
        """Note that a connection waits no more."""
        mine = self._by_address[address]
        del mine[connection]
        self._count -= 1
        if not mine:
            del self._by_address[address]

    def _oldest(self, address: str) -> T:
        connection = next(iter(self._by_address[address]))
        self.remove(connection, address)
        return connection

    def _number_of(self, address: str) -> int:
        return len(self._by_address[address])


def origin_of(address: str) -> str:
    """Return what counts as one address: of IPv6, a whole network of 64 bits.

    Returns:
        Nothing for this machine itself, and for what is no IP address, such as the
        path of a Unix socket.

    """
    try:
        ip = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return ""
    if isinstance(ip, ipaddress.IPv6Address) and ip.ipv4_mapped is not None:
        ip = ip.ipv4_mapped
    if ip.is_loopback:
        return ""
    if ip.version == 6:
        return str(ipaddress.ip_network((ip, 64), strict=False))
    return str(ip)
