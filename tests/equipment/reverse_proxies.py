"""Reverse proxies in front of WebMap: a real nginx, and one that strips a prefix."""

import contextlib
import shutil
import socket
import socketserver
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from equipment.waiting import polls

NGINX = shutil.which("nginx") or shutil.which("/usr/sbin/nginx")

CONFIGURATION = """
daemon off; pid {folder}/pid; error_log {folder}/error.log;
events {{}}
http {{
  access_log off;
  client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy;
  fastcgi_temp_path {folder}/f; uwsgi_temp_path {folder}/u; scgi_temp_path {folder}/s;
  map $http_upgrade $connection_upgrade {{ default upgrade; "" close; }}
  server {{
    listen 127.0.0.1:{port};
    {server}
  }}
}}
"""

PASS = """
      proxy_http_version 1.1;
      proxy_set_header Host $http_host;
      proxy_set_header Upgrade $http_upgrade;
      proxy_set_header Connection $connection_upgrade;
      proxy_set_header X-Forwarded-Proto $scheme;
      proxy_set_header X-Forwarded-For $remote_addr;
      proxy_buffering off;
"""
"""What docs/howto/proxy.md tells to write."""


def free_port() -> int:
    """Return a port that nothing listens on now."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def wait_for_port(port: int, process: "subprocess.Popen[bytes]") -> None:
    """Return when something accepts connections at a port."""
    for _ in polls(f"port {port}", pause=0.02):
        assert process.poll() is None, "nginx has ended"
        with contextlib.suppress(OSError):
            socket.create_connection(("127.0.0.1", port), 1).close()
            return
        time.sleep(0.02)


@contextlib.contextmanager
def nginx(folder: Path, server: str, port: int = 0) -> Iterator[int]:
    """Run the nginx of this system with a server; yield its port."""
    if NGINX is None:
        pytest.skip("nginx is not installed: apt-get install nginx-light")
    port = port or free_port()
    file = folder / "nginx.conf"
    file.write_text(CONFIGURATION.format(folder=folder, port=port, server=server))
    process = subprocess.Popen([NGINX, "-p", folder, "-c", file])
    try:
        wait_for_port(port, process)
        yield port
    finally:
        process.terminate()
        process.wait(20)


@contextlib.contextmanager
def answering(answer: Callable[[BaseHTTPRequestHandler], None]) -> Iterator[int]:
    """Run an HTTP server whose GET requests a function answers; yield its port."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            answer(self)

        def log_message(self, *args: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server.server_address[1]
        finally:
            server.shutdown()
            thread.join()


@contextlib.contextmanager
def stripping(prefix: str, port: int) -> Iterator[int]:
    """Run a proxy that removes a prefix and states nothing; yield its port.

    As jupyter-server-proxy does: ``/prefix/x`` becomes ``/x``, and the rest, with the
    Host header, stays as it is. Any other path gets the status 404.
    """

    class Handler(socketserver.StreamRequestHandler):
        def handle(self) -> None:
            head = b""
            while line := self.rfile.readline():
                head += line
                if line == b"\r\n":
                    break
            method, _, rest = head.partition(b" ")
            if not rest.startswith(f"{prefix}/".encode()):
                self.wfile.write(b"HTTP/1.1 404 No\r\nContent-Length: 0\r\n\r\n")
                return
            head = method + b" " + rest.removeprefix(prefix.encode())
            if b"upgrade: websocket" not in head.lower():  # one request each
                head = head.replace(b"Connection: keep-alive", b"Connection: close")
            with socket.create_connection(("127.0.0.1", port)) as behind:
                behind.sendall(head)
                back = threading.Thread(target=_copy, args=(behind, self.connection))
                back.start()
                with contextlib.suppress(OSError):
                    while data := self.rfile.read1(65536):
                        behind.sendall(data)
                with contextlib.suppress(OSError):
                    behind.shutdown(socket.SHUT_WR)
                back.join()

    class Server(socketserver.ThreadingTCPServer):
        daemon_threads, block_on_close = True, False
        request_queue_size = 64

    with Server(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server.server_address[1]
        finally:
            server.shutdown()
            thread.join()


def _copy(source: socket.socket, target: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while data := source.recv(65536):
            target.sendall(data)
    with contextlib.suppress(OSError):
        target.shutdown(socket.SHUT_RDWR)
