"""The page that asks for the token, the only one before a visitor has signed in."""

import base64
import hashlib
from html import escape

from starlette.responses import HTMLResponse

_STYLE = """
:root {
  color-scheme: light dark;
  --surface: #ffffff; --page: #dfe4ea; --text: #131920; --muted: #4b5765;
  --line: #7b8795; --accent: #0a58ca; --on-accent: #ffffff;
}
@media (prefers-color-scheme: dark) {
  :root {
    --surface: #161b22; --page: #0b0f14; --text: #e8edf3; --muted: #a7b3c1;
    --line: #758292; --accent: #6cabff; --on-accent: #081525;
  }
}
* { box-sizing: border-box; }
body {
  display: grid; place-items: center; min-height: 100vh; margin: 0; padding: 1rem;
  background: var(--page); color: var(--text);
  font: 1rem/1.45 -apple-system, "Segoe UI", Roboto, "Noto Sans", Arial, sans-serif;
}
main {
  width: min(26rem, 100%); padding: 2rem; border-radius: 0.75rem;
  background: var(--surface);
}
svg { width: 2.75rem; height: 2.75rem; }
rect { fill: var(--accent); }
path { fill: var(--on-accent); }
h1 { margin: 0.75rem 0 0.25rem; font-size: 1.375rem; }
p { margin: 0 0 1rem; color: var(--muted); }
.why { color: var(--text); font-weight: 600; }
label { display: block; margin-bottom: 0.25rem; font-weight: 600; }
input, button {
  width: 100%; min-height: 2.75rem; border-radius: 0.5rem; font: inherit;
}
input {
  padding: 0 0.75rem; border: 1px solid var(--line); background: var(--surface);
  color: inherit;
}
button {
  margin: 0.75rem 0 1rem; border: 0; background: var(--accent);
  color: var(--on-accent); font-weight: 650; cursor: pointer;
}
a { color: var(--accent); }
:focus-visible { outline: 3px solid var(--accent); outline-offset: 2px; }
p:last-child { margin: 0; font-size: 0.875rem; }
"""

_PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>Sign in - WebMap</title>
<style>{style}</style>
<main>
<svg viewBox="0 0 32 32" aria-hidden="true"><rect width="32" height="32" rx="7"/>
<path d="M16 6.5l8.5 18L16 20l-8.5 4.5z"/></svg>
<h1>Sign in to WebMap</h1>
<p class="why" role="status">{text}</p>
<p>Open the address that WebMap printed at its start, or enter its token:</p>
<form>
<label for="token">Token</label>
<input name="token" id="token" type="password" autocomplete="off" required autofocus>
<button>Sign in</button>
</form>
<p>If you have just signed in through another site, <a href="?">continue</a>.</p>
</main>
</html>
"""

_HASH = base64.b64encode(hashlib.sha256(_STYLE.encode()).digest()).decode()

_POLICY = (
    f"default-src 'none'; style-src 'sha256-{_HASH}'; frame-ancestors 'none'; "
    "base-uri 'none'; form-action 'self'"
)
"""This page has its style in it, and needs nothing else."""


def sign_in_page(text: str, status: int) -> HTMLResponse:
    """Return the page that asks for the token.

    Args:
        text: Why the request was refused.
        status: The HTTP status of the refusal.
    """
    page = _PAGE.format(style=_STYLE, text=escape(text))
    return HTMLResponse(page, status, {"content-security-policy": _POLICY})
