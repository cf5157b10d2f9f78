#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Tries packages as someone would who has nothing of what they are built with: installs them in a bare system of Debian
# (debootstrap), does what examples/quickstart.sh does without a compiler, uses the module of Python, builds a program
# with the libraries, and removes everything again.
#
#   cmake/debian/try.sh FOLDER [SUITE]
#
# FOLDER holds what cmake/debian/build.sh made. SUITE: bookworm, or the one that they were built on. Wants root and the
# Debian package debootstrap. TETWARP_CHROOTS names a folder in which the bare system is kept for the next time.
set -euo pipefail
[ $# -ge 1 ] || { sed -n '5,12p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
packages=$(cd "$1" && pwd)
suite=${2:-bookworm}
scratch=$(mktemp -d)
bare=${TETWARP_CHROOTS:-$scratch/chroots}/packages-$suite
root=$scratch/root
clean() {
  for mounted in proc dev; do mountpoint -q "$root/$mounted" && umount "$root/$mounted"; done
  rm -rf --one-file-system "$scratch"
}
trap clean EXIT
"$source_dir/cmake/platforms/bare_system.sh" "$bare" "$suite"
cp -a "$bare" "$root"
mount --bind /proc "$root/proc"
mount --bind /dev "$root/dev"
inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
  ${http_proxy:+http_proxy="$http_proxy"} ${https_proxy:+https_proxy="$https_proxy"} "$@"; }
install() { inside sh -c 'apt-get install -y -qq --no-install-recommends "$@" >/dev/null' sh "$@"; }
listed() { inside dpkg-query -W -f '${Package}\n' | sort; }

echo "== a bare $suite of $(listed | wc -l) packages"
listed >"$scratch/before"
cp "$packages"/*.deb "$root/tmp/"
inside apt-get update -qq
install "/tmp/$(cd "$packages" && ls tetwarp_*.deb)"
echo "== with tetwarp $(listed | wc -l)"
for program in cc g++ cmake; do
  ! inside sh -c "command -v $program" || { echo "try.sh: error: the package brings $program" >&2; exit 1; }
done
inside sh -euc '
  cd /root
  tetwarp --version
  tetwarp phantom -o phantom --size 128,128,40 --spacing 3,3,5
  tetwarp deform phantom -f wave:amplitude=8,wavelength=96 -o deformed --preview preview.png --report report.json
  tetwarp deform phantom -f bubble:radius=90,strength=0.6 -o deformed.nii.gz
  tetwarp render deformed -o bones.png --angle 25
  tetwarp invert wave:amplitude=8,wavelength=96 --like phantom -o inverse.mha
  tetwarp info deformed | head -5
  test -s /usr/share/bash-completion/completions/tetwarp -a -s /usr/share/man/man1/tetwarp-deform.1.gz'
echo "== the module of Python"
install "/tmp/$(cd "$packages" && ls python3-tetwarp_*.deb)"
cat >"$root/root/t.tfm" <<'END'
#Insight Transform File V1.0
#Transform 0
Transform: TranslationTransform_double_3_3
Parameters: 3 0 0
FixedParameters:
END
inside python3 -c '
import tetwarp as tw
ct = tw.read("/root/phantom")
assert tw.features()["itk_transforms"] and tw.read_field("/root/t.tfm", like=ct.geometry) is not None
done = tw.deform(ct, tw.fields.elastic(ct.geometry, amplitude=8, spacing=40, seed=7, cell_size=4))
print(tw.__version__, done.volume.array.shape, tw.features())'
if ls "$packages"/tetwarp-doc_*.deb >/dev/null 2>&1; then
  echo "== the documents"
  install "/tmp/$(cd "$packages" && ls tetwarp-doc_*.deb)"
  inside test -s /usr/share/doc/tetwarp-doc/html/index.html
fi
echo "== a program with the libraries"
install g++ cmake make "/tmp/$(cd "$packages" && ls libtetwarp-dev_*.deb)"
mkdir "$root/root/user"
cp "$source_dir/examples/twist_volume.cpp" "$root/root/user/"
cat >"$root/root/user/CMakeLists.txt" <<'END'
cmake_minimum_required(VERSION 3.25)
project(user LANGUAGES C CXX)
find_package(tetwarp REQUIRED COMPONENTS deform io backend)
add_executable(twist_volume twist_volume.cpp)
target_link_libraries(twist_volume PRIVATE tetwarp::deform tetwarp::io tetwarp::backend)
END
inside sh -euc 'cd /root/user && cmake -B build >/dev/null && cmake --build build >/dev/null && ./build/twist_volume | grep covered'
echo "== removed"
rm -rf "$root/root"/*
# Debian 13 has packages that apt protects, and a dependency may have brought one.
listed | comm -13 "$scratch/before" - | xargs chroot "$root" env PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive \
  apt-get purge -y -qq --allow-remove-essential >/dev/null
listed | diff "$scratch/before" - || { echo "try.sh: error: packages are left" >&2; exit 1; }
left=$( (cd "$root" && find etc usr var -xdev -iname '*tetwarp*') )
[ -z "$left" ] || { echo "try.sh: error: left behind: $left" >&2; exit 1; }
echo "== nothing is left behind"
