#!/usr/bin/env bash
# Tests the packages of deploy/build-packages.sh in a minimal Debian 12: apt installs them there,
# the unit's command runs without systemd as an unprivileged user, a picture is requested and
# another one drawn, and apt removes the packages. Needs root, debootstrap and a Debian mirror.
# Usage: deploy/try-package.sh [PACKAGE.deb...]       default: build/dist/windsplat_*.deb
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."

if [ "${1:-}" != --unshared ]; then
  # Mounts are of this process and its children only.
  exec unshare --mount --propagation private "$0" --unshared "$@"
fi
shift
packages=("$@")
[ ${#packages[@]} -gt 0 ] || packages=(build/dist/windsplat_*.deb)
work=$PWD/build/image
root=$work/package-root
log=$work/package.log

fail() {
  echo "try-package: $*" >&2
  exit 1
}
[ -f "${packages[0]}" ] || fail "no packages; run deploy/build-packages.sh"
deploy/make-base.sh

server=
finish() {
  [ -z "$server" ] || kill -KILL "$server" 2>/dev/null || true
  umount "$root/proc" 2>/dev/null || true
  rm -rf "$root"
}
trap finish EXIT
rm -rf "$root"
mkdir -p "$root"
tar -C "$root" -xf "$work/base.tar"
mount -t proc proc "$root/proc"
cp /etc/resolv.conf "$root/etc/resolv.conf"
cp -r /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d/"
mkdir "$root/packages"
cp "${packages[@]}" "$root/packages/"

inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin "$@"; }
apt() {
  inside DEBIAN_FRONTEND=noninteractive apt-get -q -y -o APT::Sandbox::User=root "$@" \
    >"$log" 2>&1 || {
    tail -n 20 "$log" >&2
    fail "apt-get $1 failed"
  }
}
before=$(du -smx "$root" | cut -f1)
apt update
mapfile -t names < <(cd "$root/packages" && printf '/packages/%s\n' *.deb)
apt install --no-install-recommends "${names[@]}"
rm -rf "$root"/var/cache/apt/* "$root"/var/lib/apt/lists/*
# shellcheck disable=SC2016  # dpkg-query fills these in
form='${db:Status-Abbrev}${Package} ${Version}\n'
echo "installed   $(inside dpkg-query -W -f "$form" '*windsplat*' |
  sed -n 's/^ii //p' | paste -sd, | sed 's/,/, /g');" \
  "$(($(du -smx "$root" | cut -f1) - before)) MB more"

# What systemd does: the variables of the unit, the token as a credential, another user.
unit=$root/lib/systemd/system/windsplat.service
mkdir -p "$root/run/try/state" "$root/run/try/cache"
token=$(od -An -N16 -tx1 /dev/urandom | tr -d ' \n')
(umask 077 && echo "$token" >"$root/run/try/token")
chown -R 65534:65534 "$root/run/try"
port=$(python3 -c 'import socket
s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
mapfile -t variables < <(sed -n 's/^Environment=//p' "$unit" |
  sed "s#%d#/run/try#; s#%S/windsplat#/run/try/state#; s#%C/windsplat#/run/try/cache#
    s#^\(WINDSPLAT_LISTEN\)=.*#\1=127.0.0.1:$port#")
read -r -a command <<<"$(sed -n 's/^ExecStart=\(.*\) \$WINDSPLAT_ARGS$/\1/p' "$unit")"
[ "${command[0]:-}" = /usr/bin/windsplat ] || fail "the unit does not start /usr/bin/windsplat"
user=(chroot --userspec=65534:65534 "$root" /usr/bin/env -i)
"${user[@]}" "${variables[@]}" "${command[@]}" >"$work/package-serve.log" 2>&1 &
server=$!
url=http://127.0.0.1:$port
for ((i = 0; ; i++)); do
  "${user[@]}" /usr/bin/windsplat healthcheck "$url/" >/dev/null 2>&1 && break
  kill -0 "$server" 2>/dev/null || fail "the server ended: $(tail -n 5 "$work/package-serve.log")"
  [ "$i" -lt 100 ] || fail "not healthy after 20 s: $(tail -n 5 "$work/package-serve.log")"
  sleep 0.2
done
echo "serves      ${command[*]}, as the user $(stat -c %U "/proc/$server")"

is_jpeg() { [ "$(head -c 2 "$1" | od -An -tx1 | tr -d ' ')" = ffd8 ]; }
frame=$url/v1/datasets/climate/frame.jpg
python3 - "$frame?width=320&height=240" "$token" "$work/package.jpg" <<'PYTHON'
import sys
import urllib.request

url, token, name = sys.argv[1:]
request = urllib.request.Request(url, headers={"Authorization": "Bearer " + token})
with urllib.request.urlopen(request) as answer, open(name, "wb") as out:
    out.write(answer.read())
PYTHON
is_jpeg "$work/package.jpg" || fail "the frame is no JPEG"
echo "frame       $(stat -c %s "$work/package.jpg") bytes"
kill -TERM "$server"
status=0
wait "$server" || status=$?
server=
[ "$status" = 0 ] || fail "after SIGTERM the server ended with $status"

# A file, which a loader process of the program reads.
"${user[@]}" /usr/bin/windsplat synth tornado -o /run/try/tornado.nc
"${user[@]}" /usr/bin/windsplat render /run/try/tornado.nc -o /run/try/tornado.jpg
is_jpeg "$root/run/try/tornado.jpg" || fail "the picture of a file is no JPEG"
echo "render      $(stat -c %s "$root/run/try/tornado.jpg") bytes, of a netCDF file"

apt purge windsplat
for left in etc/default/windsplat usr/bin/windsplat usr/share/doc/windsplat \
  lib/systemd/system/windsplat.service; do
  [ ! -e "$root/$left" ] || fail "after the removal /$left is still there"
done
echo "removed     nothing is left"
