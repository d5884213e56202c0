#!/usr/bin/env bash
# Install Chromium, Node and npm, which the tests need, if they are missing; nginx too
# where that is possible, because its tests are skipped without it.
set -euo pipefail
here=$(dirname "${BASH_SOURCE[0]}")

missing=()
if [ -n "${CHROMIUM:-}" ]; then
  if ! command -v "$CHROMIUM" >/dev/null; then
    printf 'webmap: CHROMIUM is "%s", which is no program here; set it to the path of a Chromium or Chrome, or unset it.\n' "$CHROMIUM" >&2
    exit 1
  fi
elif ! command -v chromium >/dev/null; then
  missing+=(chromium)
fi
command -v node >/dev/null || missing+=(nodejs)
command -v npm >/dev/null || missing+=(npm)
if [ "$(id -u)" -eq 0 ] && ! PATH=$PATH:/usr/sbin command -v nginx >/dev/null; then
  missing+=(nginx-light)
fi
# Playwright's driver, which controls Chromium, links to this library.
if [ "$(uname -s)" = Linux ] && ! /sbin/ldconfig -p | grep -q 'libatomic\.so\.1'; then
  missing+=(libatomic1)
fi
if [ "${#missing[@]}" -gt 0 ]; then
  "$here/install_debian.sh" "${missing[@]}"
fi
if ! node -e 'const [a, b] = process.versions.node.split("."); process.exit(a > 18 || (a == 18 && b >= 18) ? 0 : 1)'; then
  printf 'webmap: the tests need Node 18.18 or newer, got %s.\n' "$(node --version)" >&2
  exit 1
fi
