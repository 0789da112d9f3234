#!/usr/bin/env bash
# Makes build/image/base.tar, a minimal Debian 12, by debootstrap and with this machine's apt
# sources and proxy, if it is not there. Needs root. Used by build-image.sh and try-package.sh.
# Usage: deploy/make-base.sh
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."

work=$PWD/build/image
[ ! -f "$work/base.tar" ] || exit 0

fail() {
  echo "make-base: $*" >&2
  exit 1
}
command -v debootstrap >/dev/null || fail "debootstrap not found; run apt-get install debootstrap"
[ "$(id -u)" = 0 ] || fail "debootstrap needs root"

# This machine's Debian 12 sources as "URI suite component"; if none is known, debootstrap chooses.
sources() {
  # shellcheck disable=SC2016  # apt fills these in
  apt-get indextargets --format '$(REPO_URI) $(RELEASE) $(COMPONENT)' \
    'Created-By: Packages' 'Origin: Debian' 2>/dev/null |
    awk '$2 ~ /^bookworm/ && $3 == "main"' | sort -u || true
}
proxy=$(apt-config shell value Acquire::http::Proxy | sed -n "s/^value='\(.*\)'$/\1/p")
[ "${proxy:-DIRECT}" != DIRECT ] || proxy=${http_proxy:-}

mkdir -p "$work"
root=$work/base.part
rm -rf "$root"
mirror=$(sources | awk '$2 == "bookworm" {print $1; exit}')
echo "make-base: debootstrap (once)" >&2
http_proxy=$proxy debootstrap --variant=minbase bookworm "$root" ${mirror:+"$mirror"} \
  >"$work/debootstrap.log" 2>&1 || {
  tail -n 20 "$work/debootstrap.log" >&2
  fail "debootstrap failed; the whole log is build/image/debootstrap.log"
}
if [ -n "$mirror" ]; then
  sources | sed 's/^/deb /' >"$root/etc/apt/sources.list"
fi
rm -rf "$root"/var/cache/apt/* "$root"/var/lib/apt/lists/* "$root"/var/log/*.log
tar --numeric-owner -C "$root" -cf "$work/base.tar.part" .
rm -rf "$root"
mv "$work/base.tar.part" "$work/base.tar"
