#!/usr/bin/env bash
# Builds the container image without a container engine: debootstrap creates the Debian 12 base
# (cached in build/image), and buildah runs the Dockerfile in a chroot. Needs root. The build uses
# this machine's apt sources, proxy, npm settings and certificates.
# Usage: deploy/build-image.sh [--program BUILD] [TAG]
# The image stays in build/image/storage. With --program the first stage is left out, and the image
# holds the program of that build folder, which was built on Debian 12.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."

build=
if [ "${1:-}" = --program ]; then
  build=${2:?usage: deploy/build-image.sh --program BUILD [TAG]}
  shift 2
fi
tag=${1:-windsplat:$(sed -n 's/^project(windsplat VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)}
work=$PWD/build/image
base=localhost/windsplat-base:bookworm

fail() {
  echo "build-image: $*" >&2
  exit 1
}
for tool in buildah debootstrap; do
  command -v "$tool" >/dev/null || fail "$tool not found; run apt-get install buildah debootstrap"
done
[ "$(id -u)" = 0 ] || fail "debootstrap and the chroot need root"

mkdir -p "$work"
# Separate storage, so that the machine's own images are not affected.
buildah=(buildah --storage-driver vfs --root "$work/storage" --runroot "$work/run")

proxy=$(apt-config shell value Acquire::http::Proxy | sed -n "s/^value='\(.*\)'$/\1/p")
[ "${proxy:-DIRECT}" != DIRECT ] || proxy=${http_proxy:-}

deploy/make-base.sh

if ! "${buildah[@]}" inspect --type image "$base" >/dev/null 2>&1; then
  container=$("${buildah[@]}" from scratch)
  "${buildah[@]}" add --quiet "$container" "$work/base.tar" / >/dev/null
  "${buildah[@]}" config --cmd bash "$container"
  "${buildah[@]}" commit --quiet --rm "$container" "$base" >/dev/null
fi

# Times in the image are those of the last commit, so that equal files give an equal image. Settings
# of this machine are for the build only; they are not stored in the image.
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
options=(--build-arg "BASE=$base" --timestamp "$SOURCE_DATE_EPOCH")
for name in http_proxy https_proxy no_proxy; do
  [ -z "${!name:-}" ] || options+=(--build-arg "$name=${!name}")
done
[ -z "$proxy" ] || [ -n "${http_proxy:-}" ] || options+=(--build-arg "http_proxy=$proxy")
if [ -s /etc/ssl/certs/ca-certificates.crt ]; then
  options+=(--volume /etc/ssl/certs/ca-certificates.crt:/run/build-ca.crt:ro
    --build-arg NODE_EXTRA_CA_CERTS=/run/build-ca.crt)
fi
if [ -f "${HOME:-/root}/.npmrc" ]; then
  options+=(--volume "${HOME:-/root}/.npmrc:/root/.npmrc:ro")
fi

context=.
file=Dockerfile
if [ -n "$build" ]; then
  # The same Dockerfile, with a copy in place of the first stage.
  context=$work/context
  file=$context/Dockerfile
  rm -rf "$context"
  mkdir -p "$context/scripts"
  cp scripts/image-root "$context/scripts"
  install -D --strip "$build/windsplat" "$context/installed/bin/windsplat"
  scripts/sbom "$build/windsplat" >"$context/installed/windsplat.cdx.json"
  awk '/^FROM .* AS build$/ {print; print "COPY installed /opt/windsplat"; inside = 1; next}
    /^FROM / {inside = 0}
    !inside' Dockerfile >"$file"
fi

echo "build-image: $tag" >&2
"${buildah[@]}" bud --isolation chroot --format docker --layers=false --pull-never --force-rm \
  "${options[@]}" --tag "$tag" --file "$file" "$context" >"$work/build.log" 2>&1 || {
  tail -n 40 "$work/build.log" >&2
  fail "the build failed; the whole log is build/image/build.log"
}
echo "build-image: done; test it with deploy/try-image.sh" >&2
"${buildah[@]}" images --filter "reference=${tag%%:*}"
