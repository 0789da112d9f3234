#!/usr/bin/env bash
# Tests the image of deploy/build-image.sh: unpacks it, runs its server in a chroot as the image's
# user on a read-only file system, requests the health check, the datasets and one JPEG, stops it
# with SIGTERM, and draws files. Needs root.
# Usage: deploy/try-image.sh [TAG]
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."

if [ "${1:-}" != --unshared ]; then
  # Mounts are of this process and its children only.
  exec unshare --mount --propagation private "$0" --unshared "$@"
fi
shift
tag=${1:-windsplat:$(sed -n 's/^project(windsplat VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)}
work=$PWD/build/image
root=$work/rootfs

fail() {
  echo "try-image: $*" >&2
  exit 1
}
for tool in buildah python3 curl; do
  command -v "$tool" >/dev/null || fail "$tool not found; run apt-get install $tool"
done
[ "$(id -u)" = 0 ] || fail "chroot needs root"
buildah=(buildah --storage-driver vfs --root "$work/storage" --runroot "$work/run")

settings=$("${buildah[@]}" inspect --type image "$tag" 2>/dev/null) ||
  fail "no image $tag; run deploy/build-image.sh"
# Reads one value of the image's configuration by its keys.
setting() {
  python3 -c 'import json, sys
value = json.loads(sys.argv[1])["Docker"]["config"]
for key in sys.argv[2:]: value = value[key]
print("\n".join(value) if isinstance(value, list) else value)' "$settings" "$@"
}

container=$("${buildah[@]}" from --pull-never "$tag")
server=
finish() {
  [ -z "$server" ] || kill -KILL "$server" 2>/dev/null || true
  "${buildah[@]}" umount "$container" >/dev/null 2>&1 || true
  "${buildah[@]}" rm "$container" >/dev/null
  umount -R "$root" 2>/dev/null || true
  rm -rf "$root"
}
trap finish EXIT
mounted=$("${buildah[@]}" mount "$container")
rm -rf "$root"
cp -a "$mounted" "$root"

user=$(setting User)
case $user in
  [1-9]*:[1-9]*) ;;
  *) fail "the image's user '$user' is not one of two numbers beyond 0" ;;
esac
echo "user       $user"
echo "files      $(du -sm --apparent-size "$root" | cut -f1) MB"
# Read-only, but for /tmp, and with what container engines provide.
mount --bind "$root" "$root"
mount -t proc proc "$root/proc"
mount -t tmpfs tmpfs "$root/dev"
mknod -m 666 "$root/dev/null" c 1 3
mount -t tmpfs -o mode=1777 tmpfs "$root/tmp"
mount -o remount,bind,ro "$root"
enter=(env -i PATH=/usr/local/bin "$(command -v chroot)" --userspec="$user" "$root")
program=/usr/local/bin/windsplat
inside() { "${enter[@]}" "$@"; }
libraries=$(inside /lib64/ld-linux-x86-64.so.2 --list "$program") || fail "no dynamic loader"
! grep 'not found' <<<"$libraries" || fail "libraries are missing"
echo "libraries  all found"

# The image's own command, on a free port of this machine.
port=$(python3 -c 'import socket
s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
mapfile -t entry < <(setting Entrypoint)
mapfile -t command < <(setting Cmd | sed "s/:8080\$/:$port/")
url=http://127.0.0.1:$port
[ "${entry[0]}" = windsplat ] || fail "the image starts ${entry[0]}"
"${enter[@]}" "$program" "${command[@]}" >"$work/serve.log" 2>&1 &
server=$!

for ((i = 0; ; i++)); do
  inside "$program" healthcheck "$url/" >/dev/null 2>&1 && break
  kill -0 "$server" 2>/dev/null || fail "the server ended: $(tail -n 5 "$work/serve.log")"
  [ "$i" -lt 100 ] || fail "not healthy after 20 s: $(tail -n 5 "$work/serve.log")"
  sleep 0.2
done
[ "$(stat -c %u "/proc/$server")" = "${user%%:*}" ] || fail "the server does not run as $user"
echo "health     ok: $(setting Healthcheck Test | tr '\n' ' ')"

datasets=$(curl -sfS "$url/v1/datasets" |
  python3 -c 'import json, sys; print(*(d["id"] for d in json.load(sys.stdin)["datasets"]))')
[ -n "$datasets" ] || fail "no dataset"
echo "datasets   $datasets"

picture=$work/frame.jpg
curl -sfS -o "$picture" "$url/v1/datasets/climate/frame.jpg?width=320&height=240"
python3 - "$picture" 320 240 <<'PYTHON'
import struct
import sys

name, width, height = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
data = open(name, "rb").read()
if data[:2] != b"\xff\xd8" or data[-2:] != b"\xff\xd9":
    sys.exit("try-image: the frame is not a whole JPEG")
at = 2
while not 0xC0 <= data[at + 1] <= 0xC2:  # to the frame header, segment by segment
    at += 2 + struct.unpack(">H", data[at + 2:at + 4])[0]
size = struct.unpack(">HH", data[at + 5:at + 9])[::-1]
if size != (width, height):
    sys.exit(f"try-image: the frame is {size[0]} x {size[1]}, not {width} x {height}")
print(f"frame      JPEG, {width} x {height}, {len(data)} bytes ({name.rpartition('/build/')[2]})")
PYTHON

kill -TERM "$server"
status=0
wait "$server" || status=$?
server=
[ "$status" = 0 ] || fail "after SIGTERM the server ended with $status"
echo "SIGTERM    exit 0"

# Files, which a loader process reads.
inside "$program" synth tornado -o /tmp/tornado.nc
inside "$program" render /tmp/tornado.nc -o /tmp/tornado.jpg
echo "netCDF     drawn, $(stat -c %s "$root/tmp/tornado.jpg") bytes"
# GRIB files of ecCodes' own, if this machine has them: the image holds a part of the tables.
outside=build/release/windsplat
for edition in 1 2; do
  sample=/usr/share/eccodes/samples/reduced_gg_pl_128_grib$edition.tmpl
  [ -f "$sample" ] && [ -x "$outside" ] || continue
  cp "$sample" "$root/tmp/"
  diff <("$outside" inspect "$sample") <(inside "$program" inspect "/tmp/${sample##*/}") ||
    fail "a GRIB file is read in another way"
  echo "GRIB $edition     read as outside"
done
