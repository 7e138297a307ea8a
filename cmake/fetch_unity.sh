#!/bin/sh
# Puts the Unity test framework (ThrowTheSwitch, MIT) into DIRECTORY.
# usage: fetch_unity.sh DIRECTORY
#
# No registry carries Unity as a package of its own. Debian's source package ntpsec holds the
# unmodified 2.5.1 under tests/unity. apt fetches it with lists of its own, from the mirrors that
# this machine already uses; that needs no root and leaves the system's configuration alone.
# unity.sha256 pins what is accepted.
set -eu
[ $# -eq 1 ] || { echo "usage: fetch_unity.sh DIRECTORY" >&2; exit 2; }
need() {
  for tool; do
    command -v "$tool" > /dev/null 2>&1 || { echo "fetch_unity: $tool is missing; install it and run again" >&2; exit 1; }
  done
}

need sha256sum
mkdir -p "$1"
dest=$(cd "$1" && pwd)
sums=$(cd "$(dirname "$0")" && pwd)/unity.sha256

pinned() { (cd "$dest" && sha256sum --check --status "$sums" 2> /dev/null); }
pinned && exit 0

need apt-get awk sort tar xz
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/lists/partial"
apt-get indextargets --format 'deb-src $(REPO_URI) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' |
  awk '$3 !~ /-/' | sort -u > "$work/sources.list" # the base suite: its sources never move
apt_private() {
  apt-get -qq -o Dir::Etc::SourceList="$work/sources.list" -o Dir::Etc::SourceParts=/dev/null \
    -o Dir::State::Lists="$work/lists" -o Dir::Cache="$work" -o APT::Sandbox::User="$(id -un)" "$@"
}
cd "$work"
apt_private update
apt_private source --download-only ntpsec
mkdir unpacked
tar -xf ntpsec_*.orig.tar.* -C unpacked --strip-components=1
cp unpacked/tests/unity/unity.c unpacked/tests/unity/unity.h unpacked/tests/unity/unity_internals.h "$dest"
pinned || { echo "fetch_unity: the files in ntpsec differ from the pinned Unity 2.5.1" >&2; exit 1; }
