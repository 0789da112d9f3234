#!/usr/bin/env bash
# Builds the Debian packages (debian/) into build/dist. Needs debhelper and what scripts/setup
# build web installs; lintian, if installed, checks the packages. Equal sources give equal packages:
# times are those of the last commit, or SOURCE_DATE_EPOCH.
# Usage: deploy/build-packages.sh [BUILD]
# BUILD is a build folder of the preset release; by default build/package, made if needed. With
# build/arm64, which scripts/build-arm64 makes, the packages are of arm64, in build/dist-arm64.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."

build=${1:-build/package}
dist=build/dist
log=build/packages.log
cross=()
sysroot=
if [ "$build" = build/arm64 ]; then
  dist=build/dist-arm64
  cross=(dpkg-architecture -aarm64 -c)
  sysroot=$PWD/build/arm64-sysroot
fi

fail() {
  echo "build-packages: $*" >&2
  exit 1
}
command -v dh >/dev/null || fail "debhelper not found; run apt-get install debhelper"
[ -z "$sysroot" ] || [ -d "$sysroot" ] || fail "no $sysroot; run scripts/build-arm64"
[ -e web/node_modules ] || fail "no node modules; run scripts/setup build web"

version=$(sed -n 's/^project(windsplat VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
packaged=$(dpkg-parsechangelog --show-field Version)
[ "${packaged%-*}" = "$version" ] || fail "debian/changelog is of version $packaged, not $version"
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
export SOURCE_DATE_EPOCH

mkdir -p "$dist"
rm -f "$dist"/*.deb
"${cross[@]}" debian/rules clean binary BUILD="$build" DIST="$dist" SYSROOT="$sysroot" \
  >"$log" 2>&1 || {
  tail -n 20 "$log" >&2
  fail "the whole log is $log"
}
debian/rules clean BUILD="$build" >/dev/null 2>&1
ls -l "$dist"/*.deb
if command -v lintian >/dev/null; then
  # lintian refuses to run as root unless told.
  lintian --allow-root --fail-on=error,warning "$dist"/*.deb
fi
