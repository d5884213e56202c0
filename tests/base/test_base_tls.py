"""TLS: the authority of the machine, what it signs, and files that change."""

import shutil
import socket
import ssl
import threading
from datetime import UTC, datetime, timedelta

import pytest
from cryptography import x509

from webmap.base import authority
from webmap.base.errors import ConfigError
from webmap.base.tls import Renewal, tls_files


def own(folder, host="0.0.0.0"):
    """Return the files of a certificate that WebMap makes."""
    return tls_files(host, folder, True, "", "")()


def shake_hands(context, trusted, name):
    """Return the certificate that a client accepts for a name."""
    ends = socket.socketpair()
    client = ssl.create_default_context(cafile=trusted)

    def answer():
        try:
            with context.wrap_socket(ends[0], server_side=True) as server:
                server.recv(1)
        except OSError:
            ends[0].close()

    thread = threading.Thread(target=answer)
    thread.start()
    try:
        with client.wrap_socket(ends[1], server_hostname=name) as secured:
            return secured.getpeercert(binary_form=True)
    finally:
        ends[1].close()
        thread.join(10)


@pytest.mark.parametrize(
    "name", ["localhost", "127.0.0.1", "::1", socket.gethostname()]
)
def test_a_client_that_trusts_the_authority_reaches_the_machine_by_its_names(
    tmp_path, name
):
    renewal = Renewal(lambda: own(tmp_path))
    assert shake_hands(renewal.context, renewal.files.authority, name)


def test_another_name_than_those_of_the_certificate_is_refused(tmp_path):
    renewal = Renewal(lambda: own(tmp_path))
    with pytest.raises(ssl.SSLCertVerificationError, match="mismatch"):
        shake_hands(renewal.context, renewal.files.authority, "robots.lan")


def test_the_authority_is_made_once_and_its_key_is_for_its_owner_alone(tmp_path):
    first, second = own(tmp_path), own(tmp_path, "192.168.1.7")
    assert first.authority == second.authority
    assert first.fingerprint == second.fingerprint
    assert len(first.fingerprint.split(":")) == 32
    assert first.certificate != second.certificate
    private = [tmp_path / "authority-key.pem", first.key, second.key]
    assert {file.stat().st_mode & 0o077 for file in private} == {0}
    assert b"PRIVATE" not in first.authority.read_bytes()


def test_a_certificate_is_kept_until_it_must_be_renewed(tmp_path, monkeypatch):
    made = own(tmp_path).certificate.read_bytes()
    assert own(tmp_path).certificate.read_bytes() == made
    monkeypatch.setattr(authority, "_RENEWED_BELOW", timedelta(days=398))
    renewed = own(tmp_path).certificate.read_bytes()
    assert renewed != made
    left = x509.load_pem_x509_certificate(renewed).not_valid_after_utc
    assert left - datetime.now(UTC) > timedelta(days=396)


@pytest.mark.parametrize("host", ["robots.example.com", "8.8.8.8", "2001:db8::1"])
def test_the_authority_signs_private_names_and_addresses_only(tmp_path, host):
    with pytest.raises(ConfigError, match="--tls-cert"):
        own(tmp_path, host)


def test_clients_refuse_a_public_name_even_if_the_authority_signed_it(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(authority.Authority, "_may_sign", lambda *_: True)
    renewal = Renewal(lambda: own(tmp_path, "bank.example.com"))
    with pytest.raises(ssl.SSLCertVerificationError, match="permitted subtree"):
        shake_hands(renewal.context, renewal.files.authority, "bank.example.com")


def test_processes_that_start_at_once_share_one_authority(tmp_path):
    found = []
    threads = [
        threading.Thread(target=lambda: found.append(own(tmp_path).fingerprint))
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20)
    assert len(found) == 4
    assert len(set(found)) == 1


def test_a_damaged_authority_is_an_error_that_names_its_file(tmp_path):
    own(tmp_path)
    (tmp_path / "authority-key.pem").write_bytes(b"\xff" * 100)
    with pytest.raises(ConfigError, match=r"authority-key\.pem: expected a private"):
        own(tmp_path)


def given(folder):
    """Return a copy of a certificate and its key in two files."""
    pem = own(folder / "own").certificate.read_bytes()
    key, _, rest = pem.partition(b"-----BEGIN CERTIFICATE")
    certificate_file, key_file = folder / "fleet.pem", folder / "fleet.key"
    certificate_file.write_bytes(b"-----BEGIN CERTIFICATE" + rest)
    key_file.write_bytes(key)
    return certificate_file, key_file


def test_a_renewed_certificate_is_used_for_later_connections(tmp_path):
    certificate, key = given(tmp_path)
    renewal = Renewal(tls_files("", tmp_path, False, certificate, key))
    trusted = tmp_path / "own" / "authority.pem"
    before = shake_hands(renewal.context, trusted, "localhost")
    assert not renewal.look()
    shutil.rmtree(tmp_path / "own")
    given(tmp_path)
    assert renewal.look()
    assert shake_hands(renewal.context, trusted, "localhost") != before


def test_half_of_a_renewed_pair_leaves_the_old_certificate_in_use(tmp_path):
    certificate, key = given(tmp_path)
    renewal = Renewal(tls_files("", tmp_path, False, certificate, key))
    trusted = tmp_path / "trusted.pem"
    shutil.move(tmp_path / "own" / "authority.pem", trusted)
    before = shake_hands(renewal.context, trusted, "localhost")
    old_key = key.read_bytes()
    shutil.rmtree(tmp_path / "own")
    given(tmp_path)
    key.write_bytes(old_key)
    with pytest.raises(ConfigError, match="is not the private key of"):
        renewal.look()
    assert shake_hands(renewal.context, trusted, "localhost") == before


@pytest.mark.parametrize(
    ("certificate", "key", "words"),
    [
        (None, b"", "No such file"),
        (b"", b"", "expected a certificate and its private key in PEM"),
        (b"-----BEGIN CERTIFICATE-----\nAAAA\n", b"", "in PEM"),
    ],
)
def test_files_that_are_no_certificate_are_refused(tmp_path, certificate, key, words):
    files = tmp_path / "fleet.pem", tmp_path / "fleet.key"
    if certificate is not None:
        files[0].write_bytes(certificate)
    files[1].write_bytes(key)
    with pytest.raises(ConfigError, match=words):
        tls_files("", tmp_path, False, *files)()


def test_a_key_with_a_password_is_refused_instead_of_asking_for_it(tmp_path):
    from cryptography.hazmat.primitives import serialization as form

    certificate, key = given(tmp_path)
    found = form.load_pem_private_key(key.read_bytes(), None)
    locked = form.BestAvailableEncryption(b"secret")
    key.write_bytes(
        found.private_bytes(form.Encoding.PEM, form.PrivateFormat.PKCS8, locked)
    )
    with pytest.raises(ConfigError, match="has a password"):
        tls_files("", tmp_path, False, certificate, key)()


def test_without_the_package_cryptography_the_error_names_the_extra(
    tmp_path, monkeypatch
):
    monkeypatch.setitem(__import__("sys").modules, "webmap.base.authority", None)
    with pytest.raises(ConfigError, match=r"pip install 'webmap\[tls\]'"):
        own(tmp_path)


def test_the_end_of_a_certificate_is_known(tmp_path):
    renewal = Renewal(tls_files("127.0.0.1", tmp_path, True, "", ""))
    data = renewal.files.certificate.read_bytes()
    end = x509.load_pem_x509_certificate(data).not_valid_after_utc
    assert renewal.ends() == end.timestamp()
    renewal.files.certificate.unlink()
    assert renewal.ends() == 0.0
