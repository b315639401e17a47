#!/usr/bin/env bash
# A wheel in a bare Debian: check_wheel.sh WHEEL SUITE, as bookworm (12) or trixie (13)
#
# Makes a Debian without compiler and HDF5 in a temporary folder with debootstrap, installs the wheel there with pip and
# uses the program, the library and the post-processing; before that, without libgomp1, which must be named. Needs root,
# debootstrap, the mirror of Debian that apt uses, and the package index that pip uses; run by hand.
set -euo pipefail

wheel=$(readlink -f "$1")
scene=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/../../inputs/first.nml
[ "$(id -u)" -eq 0 ] || { echo "debootstrap and chroot need root" >&2; exit 1; }
command -v debootstrap >/dev/null || { echo "please install the package debootstrap" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT

# The mirror, the settings of apt and the certificates of this machine
# shellcheck disable=SC2016
mirror=$(apt-get indextargets --format '$(SITE)' 'Created-By: Packages' | grep -m 1 /debian)
root=$work/root
debootstrap --variant=minbase --include=ca-certificates,python3,python3-venv "$2" "$root" "$mirror" \
  >"$work/debootstrap.log" || { tail -n 20 "$work/debootstrap.log"; exit 1; }
cp -r /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d/"
cp /etc/resolv.conf "$root/etc/resolv.conf"
cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
cp "$wheel" "$scene" "$root/root/"
# Its own /proc and /dev go with the process.
inside() {
  # shellcheck disable=SC2016
  env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive unshare -m sh -ec '
    mount -t proc proc "$1/proc"
    mount --bind /dev "$1/dev"
    exec chroot "$1" sh -c "cd /root && $2"' sh "$root" "$1"
}

if inside "command -v cc gcc gfortran"; then exit 1; fi
inside "python3 -m venv venv && venv/bin/pip install --quiet ./*.whl"
inside "venv/bin/polydem --version 2>&1 || true" | grep -F "in the package libgomp1"
inside "venv/bin/python -c 'import polydem; polydem.version()' 2>&1 || true" |
  grep "PolydemError.*in the package libgomp1"
inside "apt-get update && apt-get install --yes --no-install-recommends libgomp1" >"$work/apt.log" 2>&1 ||
  { cat "$work/apt.log"; exit 1; }

inside "venv/bin/polydem --version"
inside "venv/bin/polydem run first.nml --threads 2 --set integrate.duration=0.02 >/dev/null"
cat >"$root/root/use.py" <<'PYTHON'
from pathlib import Path

import polydem
from polydem_post import Trajectory

with polydem.Simulation("first.nml", {"integrate.duration": 0.02}) as sim:
    sim.run()
    assert sim.state_hash in Path("results/first/log.txt").read_text(), "the library has other bits than the program"
    print(sim, sim.state_hash)
print(Trajectory("results/first")[-1])
PYTHON
inside "venv/bin/python use.py"
inside "venv/bin/polydem-post plot results/first -o picture.png >/dev/null"
[ -s "$root/root/picture.png" ]
inside "du -sh venv/lib/python3*/site-packages/polydem.libs"
echo "the wheel works in Debian $(cat "$root/etc/debian_version")"
