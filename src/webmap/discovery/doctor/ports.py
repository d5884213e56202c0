"""Where a port of this machine listens, as Linux tells; without traffic."""

import ipaddress
import struct
from collections.abc import Iterable
from pathlib import Path

TABLES = ("/proc/net/tcp", "/proc/net/tcp6")
_LISTENS = "0A"


def listening_addresses(port: int, tables: Iterable[str] = ()) -> tuple[str, ...]:
    """Return the addresses at which something on this machine takes a port's links.

    Args:
        port: The port.
        tables: The text of the kernel's tables; they are read if none is given.

    Returns:
        Each once, such as ``0.0.0.0`` for all of this machine; nothing where the
        system does not tell.

    """
    found: dict[str, None] = {}
    for table in tables or map(_read, TABLES):
        for line in table.splitlines()[1:]:
            fields = line.split()
            try:
                address, _, number = fields[1].partition(":")
                if fields[3] == _LISTENS and int(number, 16) == port:
                    found[_address(address)] = None
            except (IndexError, ValueError, struct.error):
                continue
    return tuple(found)


def is_loopback(address: str) -> bool:
    """Tell whether only this machine reaches an address."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
        return (getattr(found, "ipv4_mapped", None) or found).is_loopback
    except ValueError:
        return address == "localhost"


def _address(text: str) -> str:
    """Read an address as the kernel writes it: words in the machine's own order."""
    words = [text[i : i + 8] for i in range(0, len(text), 8)]
    packed = b"".join(struct.pack("=I", int(word, 16)) for word in words)
    return str(ipaddress.ip_address(packed))


def _read(table: str) -> str:
    try:
        return Path(table).read_text()
    except OSError:
        return ""
