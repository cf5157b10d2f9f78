#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Runs a command on a clone of the last commit in a bare system of Debian (debootstrap) that has the packages of
# examples/quickstart.sh.
#
#   cmake/platforms/inside.sh SUITE OUTPUT [--with PACKAGE]... COMMAND [ARGUMENT...]
#
# COMMAND runs in the clone's folder; what it leaves in /output there is copied to the folder OUTPUT. PACKAGE: a further one. Wants root and
# debootstrap. TETWARP_CHROOTS names a folder in which the system is kept for the next time, with what was built; TETWARP_JOBS: default
# all cores.
set -euo pipefail
usage() { sed -n '5,12p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
[ $# -ge 3 ] || usage
# What is mounted is seen here alone, and is gone with this process.
if [ -z "${TETWARP_OWN_MOUNTS:-}" ]; then
  [ "$(id -u)" = 0 ] || { echo "inside.sh: error: this wants root" >&2; exit 1; }
  TETWARP_OWN_MOUNTS=yes exec unshare --mount bash "${BASH_SOURCE[0]}" "$@"
fi
suite=$1
mkdir -p "$2"
output=$(cd "$2" && pwd)
shift 2
packages=()
while [ "${1:-}" = --with ]; do
  [ $# -ge 3 ] || usage
  packages+=("$2")
  shift 2
done
[ $# -ge 1 ] || usage
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
root=${TETWARP_CHROOTS:-$source_dir/build/chroots}/inside-$suite
mkdir -p "$(dirname "$root")"
exec {lock}>"$root.lock"
flock --nonblock "$lock" || { echo "inside.sh: error: another inside.sh is in $root" >&2; exit 1; }
"$source_dir/cmake/platforms/bare_system.sh" "$root" "$suite" git
for at in proc dev dev/pts; do mount --bind "/$at" "$root/$at"; done
inside() {
  chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
    ${http_proxy:+http_proxy="$http_proxy"} ${https_proxy:+https_proxy="$https_proxy"} ${TETWARP_JOBS:+TETWARP_JOBS="$TETWARP_JOBS"} \
    ${PIP_INDEX_URL:+PIP_INDEX_URL="$PIP_INDEX_URL"} ${SOURCE_DATE_EPOCH:+SOURCE_DATE_EPOCH="$SOURCE_DATE_EPOCH"} "$@"
}
cp -L /etc/resolv.conf "$root/etc/resolv.conf"
[ ! -f /etc/pip.conf ] || cp /etc/pip.conf "$root/etc/pip.conf"
rm -rf "$root/output" "$root/bundle"
mkdir "$root/output"
git -C "$source_dir" bundle create -q "$root/bundle" HEAD
# The folder of what was built stays, so that only what has changed since is built again.
inside sh -euc '
  [ -d /sources/.git ] || git init -q /sources
  cd /sources
  git fetch -q /bundle HEAD
  git checkout -q --force --detach FETCH_HEAD'
inside apt-get update -qq
inside sh -euc 'cd /sources && apt-get install -y -qq --no-install-recommends $(examples/quickstart.sh --packages) "$@" >/dev/null' sh ${packages[@]+"${packages[@]}"}
# Whom this machine trusts beyond the list of Debian, such as a proxy, is trusted there too.
if compgen -G '/usr/local/share/ca-certificates/*.crt' >/dev/null; then
  cp /usr/local/share/ca-certificates/*.crt "$root/usr/local/share/ca-certificates/"
  inside update-ca-certificates >/dev/null
fi
status=0
inside sh -c 'cd /sources && exec "$@"' sh "$@" || status=$?
cp -r "$root/output/." "$output"
exit $status
