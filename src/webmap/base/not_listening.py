"""Why a port cannot be listened on, in words of what to do instead."""

import errno


def why_not_listening(host: str, port: int, error: OSError) -> str:
    """Return one sentence for what the system said when a port was asked for."""
    if error.errno == errno.EADDRINUSE:
        return (
            f"port {port} on {host} is in use: end what uses it, choose another port, "
            "or 0 to let the kernel choose"
        )
    if error.errno == errno.EACCES:
        return f"port {port} on {host} is not permitted: choose one from 1024 up"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"{host} is not an address of this machine"
    return f"cannot listen on {host}, port {port}: {error.strerror}"
