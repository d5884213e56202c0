"""Error messages for a port that cannot be listened on, with advice."""

import errno


def why_not_listening(host: str, port: int, error: OSError) -> str:
    """Return one sentence for the error of the system, with advice."""
    if error.errno == errno.EADDRINUSE:
        return (
            f"port {port} on {host} is in use: end the program that uses it, or choose "
            "another port; 0 lets the system choose"
        )
    if error.errno == errno.EACCES:
        return f"port {port} on {host} is not permitted: use one from 1024 to 65535"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"{host} is not an address of this machine"
    return f"cannot listen on {host}, port {port}: {error.strerror}"
