"""The headers of every answer, whatever its status."""

from starlette.types import Message, Send

CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
    "connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'self'; require-trusted-types-for 'script'"
)

HEADERS = (
    (b"content-security-policy", CONTENT_SECURITY_POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    # Another port of this machine is the same site: SameSite does not keep it out.
    (b"cross-origin-resource-policy", b"same-origin"),
)

# An image that is opened by itself is a document; it gets no script, whatever it is.
SANDBOX = CONTENT_SECURITY_POLICY + "; sandbox"

_STARTS = {"http.response.start", "websocket.http.response.start"}


def with_headers(send: Send, cookie: str | None = None) -> Send:
    """Return ``send`` with the headers added that an answer does not have yet.

    Args:
        send: What answers.
        cookie: A whole Set-Cookie header, which is added too.

    """

    async def send_with_headers(message: Message) -> None:
        if message["type"] in _STARTS:
            headers = [
                (name, value)
                for name, value in message.get("headers", [])
                if name.lower() != b"server"
            ]
            present = {name.lower() for name, _ in headers}
            headers += [header for header in HEADERS if header[0] not in present]
            if b"cache-control" not in present:
                headers.append((b"cache-control", b"no-store"))
            if cookie is not None:
                headers.append((b"set-cookie", cookie.encode("latin-1")))
            message = {**message, "headers": headers}
        await send(message)

    return send_with_headers
