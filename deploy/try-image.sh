#!/usr/bin/env bash
# Tests the image of deploy/build-image.sh: unpacks it, runs its server in a chroot as the image's
# user, requests the health check, the datasets and one JPEG, and stops it with SIGTERM. Needs root.
# Usage: deploy/try-image.sh [TAG]
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."

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
  rm -rf "$root"
}
trap finish EXIT
mounted=$("${buildah[@]}" mount "$container")
rm -rf "$root"
cp -a "$mounted" "$root"

user=$(setting User)
ids=$(awk -F: -v name="$user" '$1 == name {print $3 ":" $4}' "$root/etc/passwd")
case $ids in
  '' | 0:*) fail "the image's user '$user' is unknown or root" ;;
esac
enter=(chroot --userspec="$ids" "$root" /usr/bin/env -i PATH=/usr/local/bin:/usr/bin:/bin)
inside() { "${enter[@]}" "$@"; }

echo "user       $user ($ids)"
echo "files      $(du -sm "$root" | cut -f1) MB"
missing=$(inside ldd /usr/local/bin/windsplat | grep 'not found' || true)
[ -z "$missing" ] || fail "libraries are missing:
$missing"
echo "libraries  all found"

# The image's own command, on a free port of this machine.
port=$(python3 -c 'import socket
s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
mapfile -t entry < <(setting Entrypoint)
mapfile -t command < <(setting Cmd | sed "s/:8080\$/:$port/")
url=http://127.0.0.1:$port
"${enter[@]}" "${entry[@]}" "${command[@]}" >"$work/serve.log" 2>&1 &
server=$!

for ((i = 0; ; i++)); do
  inside windsplat healthcheck "$url/" >/dev/null 2>&1 && break
  kill -0 "$server" 2>/dev/null || fail "the server ended: $(tail -n 5 "$work/serve.log")"
  [ "$i" -lt 100 ] || fail "not healthy after 20 s: $(tail -n 5 "$work/serve.log")"
  sleep 0.2
done
[ "$(stat -c %u "/proc/$server")" = "${ids%%:*}" ] || fail "the server does not run as $user"
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
