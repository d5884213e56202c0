"""TLS of this process's servers: the files, the names, and the renewal."""

import _ssl
import contextlib
import socket
import ssl
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from webmap.base.errors import ConfigError

ALL_ADDRESSES = frozenset({"", "0.0.0.0", "::"})  # noqa: S104 - to recognise, not to bind


@dataclass(frozen=True, slots=True)
class TlsFiles:
    """The files with which a server proves which machine it is."""

    certificate: Path
    """PEM: the server's certificate, then those between it and its authority."""

    key: Path
    """PEM: its private key, without a password. It may be in the same file."""

    authority: Path | None = None
    """PEM: the authority's certificate for people to import; None if they have it."""

    fingerprint: str = ""
    """SHA-256 of the authority's certificate, as browsers show it."""


def tls_files(
    host: str, folder: Path, own: bool, certificate: str | Path, key: str | Path
) -> Callable[[], TlsFiles] | None:
    """Return what finds the files for the given options; None for no TLS.

    Each call checks the files, and renews those that WebMap makes.

    Args:
        host: What the server listens on: a name or an address of this machine, or
            ``"0.0.0.0"`` for all.
        folder: Where WebMap keeps its authority and the certificates.
        own: Whether WebMap makes the certificate.
        certificate: In place of that, the file of a given one; empty for none.
        key: The file with its private key; empty for none.

    Raises:
        ConfigError: If the options contradict each other.

    """
    if own and (certificate or key):
        raise ConfigError(
            "expected either tls (--tls), for a certificate that WebMap makes, or "
            "tls_cert and tls_key (--tls-cert, --tls-key) for a given one, got both"
        )
    if bool(certificate) != bool(key):
        raise ConfigError(
            "TLS needs the certificate (tls_cert, --tls-cert) and its private key "
            "(tls_key, --tls-key), got one of them"
        )
    if own:
        return lambda: _own_files(host, folder)
    files = TlsFiles(Path(certificate), Path(key))

    def given() -> TlsFiles:
        server_context(files)
        return files

    return given if certificate else None


def _own_files(host: str, folder: Path) -> TlsFiles:
    try:
        from webmap.base.authority import Authority
    except ImportError:
        raise ConfigError(
            "--tls makes a certificate with the package cryptography, which is not "
            "installed: pip install 'webmap[tls]', or give a certificate with "
            "--tls-cert and --tls-key"
        ) from None
    if not host.isascii():
        raise ConfigError(f"host {host!r}: expected a name in ASCII")
    own = socket.gethostname().lower()
    try:
        authority = Authority(folder, own)
        file = authority.certify(_names(host, own))
    except OSError as error:
        raise ConfigError(f"{folder}: cannot keep certificates: {error}") from None
    return TlsFiles(file, file, authority.file, authority.fingerprint)


def _names(host: str, own: str) -> list[str]:
    """Return how others name this machine; the last name must be in the certificate."""
    names = ["127.0.0.1", "::1"]
    if host not in ALL_ADDRESSES:
        return [*names, "localhost", host.strip("[]").lower()]
    with contextlib.suppress(OSError):
        names += [str(found[4][0]) for found in socket.getaddrinfo(own, None)]
    for family, far in (
        (socket.AF_INET, "192.0.2.1"),
        (socket.AF_INET6, "2001:db8::1"),
    ):
        # Nothing is sent: the kernel chooses the address for the way there.
        with (
            contextlib.suppress(OSError),
            socket.socket(family, socket.SOCK_DGRAM) as s,
        ):
            s.connect((far, 9))
            names.append(s.getsockname()[0])
    names = [name.partition("%")[0] for name in names]
    if own.isascii():
        names += [own, f"{own}.local"]
    return [*names, "localhost"]


def server_context(files: TlsFiles) -> ssl.SSLContext:
    """Return the TLS settings of a server.

    Raises:
        ConfigError: If the files cannot be used.

    """
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    load(context, files)
    return context


def load(context: ssl.SSLContext, files: TlsFiles) -> None:
    """Read the files into a context; later connections use them.

    Raises:
        ConfigError: If the files cannot be used; the message has the reason.

    """

    def no_password() -> str:
        raise ConfigError(
            f"{files.key}: the private key has a password; expected one without, which "
            "only the user of WebMap can read"
        )

    for file in (files.certificate, files.key):
        try:
            file.open("rb").close()
        except OSError as error:
            raise ConfigError(f"{file}: {error.strerror}") from None
    try:
        context.load_cert_chain(files.certificate, files.key, no_password)
    except ssl.SSLError as error:
        why = error.reason or str(error)
        if why == "KEY_VALUES_MISMATCH":
            raise ConfigError(
                f"{files.key} is not the private key of {files.certificate}"
            ) from None
        raise ConfigError(
            f"{files.certificate} and {files.key}: expected a certificate and its "
            f"private key in PEM: {why.replace('_', ' ').lower()}"
        ) from None


class Renewal:
    """Settings of a server's TLS that follow the files of its certificate.

    Args:
        find: Returns the files, and checks or renews them; may wait for the network.

    Raises:
        ConfigError: If ``find`` raises it.

    """

    def __init__(self, find: Callable[[], TlsFiles]) -> None:
        self._find = find
        self.files = find()
        """The files in use."""
        self.context = server_context(self.files)
        """What a server uses; connections that are open keep their certificate."""
        self._stamp = _stamp(self.files)

    def ends(self) -> float:
        """Return when the certificate expires, in Unix seconds; 0 if unknown."""
        # The ssl module has no public function for a certificate of its own side.
        try:
            found = _ssl._test_decode_cert(str(self.files.certificate))  # type: ignore[attr-defined]
        except OSError:
            return 0.0
        return ssl.cert_time_to_seconds(found["notAfter"])

    def look(self) -> bool:
        """Load the files again if they have changed, and return whether they have.

        Raises:
            ConfigError: If the new files cannot be used; the old certificate stays.

        """
        files = self._find()
        stamp = _stamp(files)
        if stamp == self._stamp:
            return False
        # First into settings of their own: a key without its certificate would end all
        # new connections.
        server_context(files)
        load(self.context, files)
        self.files, self._stamp = files, stamp
        return True


def _stamp(files: TlsFiles) -> list[tuple[int, int, int]]:
    found = [file.stat() for file in (files.certificate, files.key)]
    return [(one.st_mtime_ns, one.st_size, one.st_ino) for one in found]
