"""An authority of this machine's user, which signs certificates for TLS.

The authority is made once and kept in WebMap's state folder. People import its
certificate into their browsers and agents; its key does not leave the folder. It can
sign private names and addresses only, so that a stolen key is of no use against other
sites.
"""

import ipaddress
import os
import secrets
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import cast

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID

from webmap.base.errors import ConfigError
from webmap.base.plain_files import read_file, write_file

_LARGEST = 1 << 16
_AUTHORITY_LIFE = timedelta(days=3650)
_LIFE = timedelta(days=397)
_RENEWED_BELOW = timedelta(days=300)
# Clocks of other machines may be slow.
_BACKDATED = timedelta(days=1)

_PRIVATE_NAMES = ("localhost", "local", "lan", "internal", "home.arpa", "test")
_PRIVATE_NETWORKS = (
    "127.0.0.0/8",
    "10.0.0.0/8",
    "172.16.0.0/12",
    "192.168.0.0/16",
    "169.254.0.0/16",
    "100.64.0.0/10",
    "::1/128",
    "fc00::/7",
    "fe80::/10",
)

_Network = ipaddress.IPv4Network | ipaddress.IPv6Network


class Authority:
    """The authority that a folder keeps; a missing one is made.

    Args:
        folder: For the key of the authority, its certificate and those that it signs.
        own_name: The name of this machine, which a new authority may sign too.

    Raises:
        ConfigError: If a file of the folder is damaged.
        OSError: If the folder cannot be used.

    """

    def __init__(self, folder: Path, own_name: str) -> None:
        self._folder = folder
        # One file, so that a key never has the certificate of another authority.
        file = folder / "authority-key.pem"
        if not file.exists():
            _write_once(file, _new_authority(own_name))
        pem = read_file(file, _LARGEST, links=False)
        try:
            key = serialization.load_pem_private_key(pem, None)
            self._certificate = x509.load_pem_x509_certificate(pem)
        except ValueError as error:
            raise ConfigError(
                f"{file}: expected a private key and a certificate: {error}; delete "
                "the file to make a new authority, which people must then import"
            ) from None
        assert isinstance(key, ec.EllipticCurvePrivateKey)
        self._key = key
        self.file = folder / "authority.pem"
        """The certificate, which people import."""
        public = _pem(self._certificate)
        if not self.file.exists() or self.file.read_bytes() != public:
            write_file(self.file, public)
            self.file.chmod(0o644)

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the certificate, as browsers show it."""
        return self._certificate.fingerprint(hashes.SHA256()).hex(":").upper()

    def certify(self, names: Iterable[str]) -> Path:
        """Return a file with a key and a certificate for a server.

        A certificate that has these names and is valid for 300 days or more is kept.

        Args:
            names: Names and addresses of the server. The last one must be private;
                those of the others that are not are left out.

        Raises:
            ConfigError: If the last name is not private.
            OSError: If the file cannot be written.

        """
        *others, asked = dict.fromkeys(names)
        signed = [name for name in (*others, asked) if self._may_sign(name)]
        if asked not in signed:
            raise ConfigError(
                f"WebMap's own authority signs private names and addresses only, got "
                f"{asked!r}: give a certificate for it with --tls-cert and --tls-key"
            )
        file = self._folder / f"{''.join(c if c.isalnum() else '-' for c in asked)}.pem"
        if not self._is_good(file, signed):
            write_file(file, self._sign(signed))
        return file

    def _may_sign(self, name: str) -> bool:
        found = self._certificate.extensions.get_extension_for_class(
            x509.NameConstraints
        )
        asked = _general(name)
        return any(
            name == one.value or name.endswith(f".{one.value}")
            if isinstance(one, x509.DNSName)
            else asked.value in cast(_Network, one.value)
            for one in found.value.permitted_subtrees or ()
            if isinstance(one, type(asked))
        )

    def _is_good(self, file: Path, names: list[str]) -> bool:
        try:
            found = x509.load_pem_x509_certificate(
                read_file(file, _LARGEST, links=False)
            )
            found.verify_directly_issued_by(self._certificate)
            alternatives = found.extensions.get_extension_for_class(
                x509.SubjectAlternativeName
            )
        except Exception:  # missing, of an earlier authority, or damaged
            return False
        has = {str(one.value) for one in alternatives.value}
        left = found.not_valid_after_utc - datetime.now(UTC)
        return has >= {*names} and left >= _RENEWED_BELOW

    def _sign(self, names: list[str]) -> bytes:
        key = ec.generate_private_key(ec.SECP256R1())
        issuer = self._certificate.extensions.get_extension_for_class(
            x509.SubjectKeyIdentifier
        )
        made = (
            _builder(f"WebMap at {names[-1]}", key, _LIFE)
            .issuer_name(self._certificate.subject)
            .add_extension(x509.SubjectAlternativeName(map(_general, names)), False)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), True)
            .add_extension(_usage(signs=False), True)
            .add_extension(
                x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), False
            )
            .add_extension(
                x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(
                    issuer.value
                ),
                False,
            )
        )
        return _key_pem(key) + _pem(made.sign(self._key, hashes.SHA256()))


def _new_authority(own_name: str) -> bytes:
    key = ec.generate_private_key(ec.SECP256R1())
    title = f"WebMap authority of {own_name}, {secrets.token_hex(4)}"
    names = dict.fromkeys((*_PRIVATE_NAMES, own_name))
    made = (
        _builder(title, key, _AUTHORITY_LIFE)
        .issuer_name(_name(title))
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), True)
        .add_extension(_usage(signs=True), True)
        .add_extension(
            x509.NameConstraints(
                permitted_subtrees=[
                    *map(x509.DNSName, names),
                    *(
                        x509.IPAddress(ipaddress.ip_network(one))
                        for one in _PRIVATE_NETWORKS
                    ),
                ],
                excluded_subtrees=None,
            ),
            True,
        )
    )
    return _key_pem(key) + _pem(made.sign(key, hashes.SHA256()))


def _builder(
    title: str, key: ec.EllipticCurvePrivateKey, life: timedelta
) -> x509.CertificateBuilder:
    now = datetime.now(UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(_name(title))
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _BACKDATED)
        .not_valid_after(now + life)
        .add_extension(
            x509.SubjectKeyIdentifier.from_public_key(key.public_key()), False
        )
    )


def _name(title: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, title[:64])])


def _usage(*, signs: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs,
        key_cert_sign=signs,
        crl_sign=signs,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _general(name: str) -> x509.IPAddress | x509.DNSName:
    try:
        return x509.IPAddress(ipaddress.ip_address(name))
    except ValueError:
        return x509.DNSName(name)


def _pem(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(serialization.Encoding.PEM)


def _key_pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )


def _write_once(file: Path, data: bytes) -> None:
    """Write a file, unless another process has written it meanwhile."""
    new = file.with_name(f".{file.name}.{secrets.token_hex(8)}")
    write_file(new, data)
    try:
        os.link(new, file)
    except FileExistsError:
        pass
    finally:
        new.unlink()
