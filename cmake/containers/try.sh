#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Builds the container for CPUs of the working tree, and uses it: a user who is not root makes a phantom, deforms, draws
# and inverts, and the bits are compared with those that every machine has to give (tests/bits). No registry is asked: a
# bare system of Debian (debootstrap) stands for the base image.
#
#   cmake/containers/try.sh [HOW] [SUITE]
#
# HOW: image       buildah builds Dockerfile and runs the image; where buildah cannot work, the same as chroot (default)
#      chroot      the steps of Dockerfile, read from it, run in bare systems
#      definition  the same with the steps of tetwarp.def, which is Apptainer's
# SUITE: bookworm (default) or trixie.
#
# Wants root, debootstrap and python3; for an image the Debian package buildah. TETWARP_JOBS: default all cores.
# TETWARP_CHROOTS names a folder in which the bare system is kept for the next time.
set -euo pipefail
usage() { sed -n '5,18p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
fail() { echo "try.sh: error: $*" >&2; exit 1; }
[ $# -le 2 ] || usage
how=${1:-image}
suite=${2:-bookworm}
[[ $how =~ ^(image|chroot|definition)$ ]] || usage
[ "$(id -u)" = 0 ] || fail "this wants root"
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
containers=$source_dir/cmake/containers
jobs=${TETWARP_JOBS:-$(nproc)}
path=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
scratch=$(mktemp -d)
mounted=()
bind() { mkdir -p "$2" && mount --bind "$1" "$2" && mounted+=("$2"); }
images() { TMPDIR=$scratch buildah --root "$scratch/storage" --runroot "$scratch/run" --storage-driver vfs "$@"; }
clean() {
  local at
  for ((at = ${#mounted[@]} - 1; at >= 0; at--)); do umount "${mounted[at]}"; done
  [ ! -d "$scratch/storage" ] || images umount --all >/dev/null || true
  rm -rf --one-file-system "$scratch"
}
trap clean EXIT

bare=${TETWARP_CHROOTS:-$scratch/chroots}/packages-$suite
"$source_dir/cmake/platforms/bare_system.sh" "$bare" "$suite"

# What is built: the sources with what is not committed, but without what was built before.
context=$scratch/context
mkdir "$context"
(cd "$source_dir" && git ls-files -z --cached --others --exclude-standard | tar --null --ignore-failed-read -T - -c) | tar -x -C "$context"
[ ! -d "$source_dir/.git" ] || cp -a "$source_dir/.git" "$context/"

# new_root FOLDER: a copy of the bare system. inside FOLDER [NAME=VALUE...] COMMAND...: runs in it, in a clean environment.
new_root() {
  cp -a "$bare" "$1"
  cp -L /etc/resolv.conf "$1/etc/resolv.conf"
  bind /proc "$1/proc"
  bind /dev "$1/dev"
}
inside() {
  chroot "$1" env -i PATH=$path HOME=/root ${http_proxy:+http_proxy="$http_proxy"} ${https_proxy:+https_proxy="$https_proxy"} "${@:2}"
}

# Each way of building sets `root`, the folder of the finished system, and `entry`, the command that the container is.
environment=()

# base_image: makes the image localhost/debootstrap, and runs a program in it.
base_image() {
  local container
  command -v buildah || { echo "buildah is not installed"; return 1; }
  container=$(images from scratch) && tar -C "$bare" -cf "$scratch/base.tar" . && images add -q "$container" "$scratch/base.tar" / >/dev/null &&
    images run --isolation chroot "$container" -- true && images commit -q "$container" localhost/debootstrap >/dev/null &&
    images rm "$container" >/dev/null && rm "$scratch/base.tar"
}

build_image() {
  images build --isolation chroot --build-arg BUILD_BASE=localhost/debootstrap --build-arg RUN_BASE=localhost/debootstrap \
    --build-arg "JOBS=$jobs" --build-arg "REVISION=$(git -C "$source_dir" rev-parse HEAD || true)" \
    --ignorefile "$containers/Dockerfile.dockerignore" -f "$containers/Dockerfile" -t localhost/tetwarp "$context"
  container=$(images from localhost/tetwarp)
  read -ra entry <<<"$(images inspect --format '{{range .OCIv1.Config.Entrypoint}}{{.}} {{end}}' "$container")"
  # shellcheck disable=SC2016  # the dollars are those of buildah's template
  images inspect --format '{{range $name, $value := .OCIv1.Config.Labels}}{{$name}}: {{$value}}{{"\n"}}{{end}}' "$container"
  root=$(images mount "$container")
  bind /proc "$root/proc"
}

# Reads the instructions of Dockerfile that are used in it, and does what they say.
build_chroot() {
  local -A given=([JOBS]=$jobs) stages=()
  local line rest name value folder words from source destination
  while IFS= read -r line <&3; do
    rest=${line#* }
    case ${line%% *} in
      '' | LABEL | CMD) ;;
      FROM)
        root=$scratch/stage-${#stages[@]}
        stages[${rest##* }]=$root
        new_root "$root"
        environment=()
        folder=/ ;;
      ARG)
        name=${rest%%=*} value=${rest#*=}
        environment+=("$name=${given[$name]-${value//\"/}}") ;;
      ENV) environment+=("$rest") ;;
      WORKDIR)
        folder=$rest
        mkdir -p "$root$folder" ;;
      COPY)
        read -ra words <<<"$rest"
        from=$context
        if [[ ${words[0]} = --from=* ]]; then
          from=${stages[${words[0]#--from=}]}
          words=("${words[@]:1}")
        fi
        source=$from/${words[0]} destination=$root${words[1]}
        [[ ! -d $source ]] || source=$source/.
        [[ ! -d $source && $destination != */ ]] || mkdir -p "$destination"
        cp -a "$source" "$destination" ;;
      RUN)
        echo "-- $rest"
        inside "$root" "${environment[@]}" sh -ec "cd $folder; $rest" ;;
      ENTRYPOINT) read -ra entry <<<"$(tr -d '[]",' <<<"$rest")" ;;
      *) fail "Dockerfile: no way to do this here: $line" ;;
    esac
  done 3< <(sed -e '/^[[:space:]]*#/d' -e ':again' -e '/\\$/{N;s/\\\n[[:space:]]*/ /;b again' -e '}' "$containers/Dockerfile")
}

# section STAGE NAME: a section of the STAGE-th stage of tetwarp.def, with the values of its arguments.
section() {
  local name value script=""
  while IFS='= ' read -r name value; do
    [ "$name" != JOBS ] || value=$jobs
    [ -z "$name" ] || script+="s|{{ $name }}|$value|g;"
  done < <(section_text "$1" arguments)
  section_text "$1" "$2" | sed "$script"
}
section_text() {
  awk -v stage="$1" -v name="$2" '/^Bootstrap:/ { at++; on = 0 } /^%/ { on = at == stage && $1 == "%" name; next } on' "$containers/tetwarp.def"
}

# Does what Apptainer does of a definition: copies files, and runs %post and %test by `sh -e`.
build_definition() {
  local stage source destination
  for stage in 1 2; do
    root=$scratch/stage-$stage
    new_root "$root"
    while read -r source destination; do
      [ -n "$source" ] || continue
      mkdir -p "$(dirname "$root$destination")"
      if [ $stage = 1 ]; then
        (cd "$context" && cp -fLr "$source" "$root$destination")
      else
        cp -fr "$scratch/stage-1$source" "$root$destination"
      fi
    done < <(section $stage files)
    section $stage post >"$root/post.sh"
    inside "$root" sh -e /post.sh
    rm "$root/post.sh"
  done
  { echo '#!/bin/sh'; section 2 environment; section 2 runscript; } >"$root/runscript"
  chmod 755 "$root/runscript"
  entry=(/runscript)
  inside "$root" sh -e <<<"$(section 2 test)"
}

if [ "$how" = image ] && ! base_image >"$scratch/log" 2>&1; then
  echo "== buildah cannot work here, so the steps of Dockerfile run in a chroot; it said:"
  tail -3 "$scratch/log"
  how=chroot
fi
case $how in
  image) echo "== Dockerfile, $suite: $(buildah --version)" ;;
  chroot) echo "== the steps of Dockerfile in a chroot, $suite" ;;
  definition) echo "== the steps of tetwarp.def in a chroot, $suite; Apptainer itself is not tried" ;;
esac
"build_$how"

echo "== packages: $(inside "$bare" dpkg-query -W -f 'x\n' | wc -l) in the bare system, $(inside "$root" dpkg-query -W -f 'x\n' | wc -l) in the container, of"
paste -sd ' ' "$root/usr/local/share/tetwarp/needed-packages"
echo "size: $(du -sxm --exclude=./proc --exclude=./dev "$root" | cut -f1) MB; command: ${entry[*]}"
for program in cc g++ cmake; do
  ! inside "$root" sh -c "command -v $program" || fail "the container has $program"
done

# What is to be deformed lies in a folder of a user with number 1234, of whom the container knows nothing.
data=$scratch/data
mkdir -m 755 "$data"
chown 1234:1234 "$data"
if [ "$how" = image ]; then
  contained() { images run --isolation chroot --user 1234:1234 --volume "$data:/data" --workingdir /data "$container" -- "${entry[@]}" "$@"; }
else
  bind "$data" "$root/data"
  contained() { chroot --userspec=1234:1234 --groups= "$root" env -i -C /data PATH=$path "${environment[@]}" "${entry[@]}" "$@"; }
fi
contained --version
contained phantom -o phantom --size 128,128,40 --spacing 3,3,5
contained deform phantom -f wave:amplitude=8,wavelength=96 -o deformed --preview preview.png --report report.json
contained deform phantom -f bubble:radius=90,strength=0.6 -o deformed.nii.gz
contained render deformed -o bones.png --angle 25
contained invert wave:amplitude=8,wavelength=96 --like phantom -o inverse.mha
contained info deformed
for output in phantom deformed preview.png report.json deformed.nii.gz bones.png inverse.mha; do
  [ -s "$data/$output" ] || fail "there is no $output"
  [ "$(stat -c %u "$data/$output")" = 1234 ] || fail "$output does not belong to who made it"
done
echo "== the bits"
bind "$scratch/data" "$root$scratch/data"
# shellcheck disable=SC2016  # the script that is written knows its folder
printf '#!/bin/sh\nexec chroot "%s" env -C "$PWD" PATH=%s "$@"\n' "$root" $path >"$scratch/launch"
chmod 755 "$scratch/launch"
TMPDIR=$data "$source_dir/tests/bits/check.py" "$(inside "$root" sh -c 'command -v tetwarp')" --launcher "$scratch/launch" | tail -1
