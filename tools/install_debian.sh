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
# Another apt-get may run. The installation waits for its lock by itself, but the update
# of the lists has no option for this.
for ((attempt = 1; ; attempt++)); do
  if message=$(LC_ALL=C apt-get update -qq 2>&1); then
    break
  fi
  if [[ $message != *"Could not get lock"* ]] || ((attempt == 120)); then
    printf '%s\n' "$message" >&2
    exit 1
  fi
  sleep 5
done
apt-get install -o DPkg::Lock::Timeout=600 -y -qq --no-install-recommends -o Dpkg::Use-Pty=0 "$@" >/dev/null
