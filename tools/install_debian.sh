#!/usr/bin/env bash
# Install Debian packages if the user is root; otherwise print the missing packages.
#
# usage: tools/install_debian.sh PACKAGE...
set -euo pipefail

if ! command -v apt-get >/dev/null; then
  printf 'webmap: this needs %s: install the packages of your system with these programs, then run it again.\n' "$*" >&2
  exit 1
fi
if [ "$(id -u)" -ne 0 ]; then
  printf 'webmap: this needs Debian packages: run "sudo apt-get install %s", then run it again.\n' "$*" >&2
  exit 1
fi
printf 'webmap: installing %s\n' "$*" >&2
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
apt-get install -y -qq --no-install-recommends -o Dpkg::Use-Pty=0 "$@" >/dev/null
