#!/usr/bin/env bash
# Builds the Debian packages (debian/) into build/dist. Needs debhelper and what scripts/setup
# build web installs; lintian, if installed, checks the packages. Equal sources give equal packages:
# times are those of the last commit, or SOURCE_DATE_EPOCH.
# Usage: deploy/build-packages.sh [BUILD]
# BUILD is a build folder of the preset release; by default build/package, made if needed.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."

build=${1:-build/package}
dist=build/dist
log=build/packages.log

fail() {
  echo "build-packages: $*" >&2
  exit 1
}
command -v dh >/dev/null || fail "debhelper not found; run apt-get install debhelper"
[ -e web/node_modules ] || fail "no node modules; run scripts/setup build web"

version=$(sed -n 's/^project(windsplat VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
packaged=$(dpkg-parsechangelog --show-field Version)
[ "${packaged%-*}" = "$version" ] || fail "debian/changelog is of version $packaged, not $version"
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
export SOURCE_DATE_EPOCH

mkdir -p "$dist"
rm -f "$dist"/*.deb
debian/rules clean binary BUILD="$build" DIST="$dist" >"$log" 2>&1 || {
  tail -n 20 "$log" >&2
  fail "the whole log is $log"
}
debian/rules clean BUILD="$build" >/dev/null 2>&1
ls -l "$dist"/*.deb
if command -v lintian >/dev/null; then
  # lintian refuses to run as root unless told.
  lintian --allow-root --fail-on=error,warning "$dist"/*.deb
fi
