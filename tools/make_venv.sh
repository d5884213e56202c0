#!/usr/bin/env bash
# Make a virtual environment with Python 3.11 or newer, or print what is missing.
#
# usage: tools/make_venv.sh FOLDER        (PYTHON=... names the interpreter to use)
set -euo pipefail
folder=$1
here=$(dirname "${BASH_SOURCE[0]}")

# A working environment is kept; an incomplete one is created again.
if "$folder/bin/python" -m pip --version >/dev/null 2>&1; then
  exit 0
fi

find_python() {
  local name
  for name in "${PYTHON:-python3}" python3.11 python3.12 python3.13 python3.14; do
    if "$name" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
      printf '%s\n' "$name"
      return 0
    fi
  done
  return 1
}

if ! python=$(find_python); then
  "$here/install_debian.sh" python3 python3-venv
  python=$(find_python) || {
    printf 'webmap: this needs Python 3.11 or newer, and %s is not.\n' \
      "$(python3 --version 2>&1 || true)" >&2
    exit 1
  }
fi
# Debian has the files that venv needs in a separate package.
if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
  "$here/install_debian.sh" python3-venv
fi
"$python" -m venv --clear "$folder"
