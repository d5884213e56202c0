#!/usr/bin/env bash
# See to it that Chromium, Node and npm are there, which the tests need.
set -euo pipefail
here=$(dirname "${BASH_SOURCE[0]}")

missing=()
command -v chromium >/dev/null || missing+=(chromium)
command -v node >/dev/null || missing+=(nodejs)
command -v npm >/dev/null || missing+=(npm)
# Playwright's driver, which steers Chromium, links to it.
if [ "$(uname -s)" = Linux ] && ! /sbin/ldconfig -p | grep -q 'libatomic\.so\.1'; then
  missing+=(libatomic1)
fi
if [ "${#missing[@]}" -gt 0 ]; then
  "$here/install_debian.sh" "${missing[@]}"
fi
if ! node -e 'const [a, b] = process.versions.node.split("."); process.exit(a > 18 || (a == 18 && b >= 18) ? 0 : 1)'; then
  printf 'webmap: the tests need Node 18.18 or newer, and this is %s.\n' "$(node --version)" >&2
  exit 1
fi
