#!/usr/bin/env bash
# The Debian package, installed in a clean Debian 12: check_package.sh BUILD
#
# Makes the package of a build folder with cpack and a Debian 12 in a temporary folder with debootstrap, installs the
# package there with its dependencies and runs the program. Needs root, debootstrap and the mirror of Debian that apt
# uses; takes some minutes, so it is run by hand.
set -euo pipefail

build=$(readlink -f "$1")
[ "$(id -u)" -eq 0 ] || { echo "debootstrap and chroot need root" >&2; exit 1; }
command -v debootstrap >/dev/null || { echo "please install the package debootstrap" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT
(cd "$build" && cpack -G DEB -B "$work/package" >"$work/cpack.log") || { cat "$work/cpack.log"; exit 1; }

# The mirror and the settings of apt of this machine
# shellcheck disable=SC2016
mirror=$(apt-get indextargets --format '$(SITE)' 'Created-By: Packages' | grep -m 1 /debian)
root=$work/root
debootstrap --variant=minbase bookworm "$root" "$mirror" >"$work/debootstrap.log" ||
  { tail -n 20 "$work/debootstrap.log"; exit 1; }
cp -r /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d/"
cp /etc/resolv.conf "$root/etc/resolv.conf"
cp "$work"/package/*.deb "$root/polydem.deb"
inside() { env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 chroot "$root" "$@"; }
inside apt-get update >"$work/apt.log" 2>&1 || { cat "$work/apt.log"; exit 1; }
inside env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends /polydem.deb \
  >"$work/apt.log" 2>&1 || { cat "$work/apt.log"; exit 1; }

inside polydem --version
inside polydem_lab --version >/dev/null
inside polydem check /usr/share/polydem/inputs/first.nml >/dev/null
inside sh -c 'cd /root && polydem run /usr/share/polydem/inputs/stack.nml --threads 1' | tail -n 1
inside sh -c 'cd /root && polydem info --check results/stack' >/dev/null
for file in man/man1/polydem.1.gz man/man1/polydem.1 bash-completion/completions/polydem; do
  [ ! -e "$root/usr/share/$file" ] || echo "share/$file"
done
[ -z "$(inside sh -c 'ldd /usr/bin/polydem | grep "not found"' || true)" ]
inside dpkg --purge polydem >/dev/null
[ ! -e "$root/usr/bin/polydem" ]
echo "the package installs, runs and goes"
