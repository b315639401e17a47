#!/usr/bin/env bash
# HDF5 of this Debian without its driver for files of S3, which polydem never calls: make_hdf5.sh FOLDER
#
# The driver needs libcurl, and so 27 more libraries. Takes Debian's source package, builds the libraries of C and
# Fortran with the filters and the locks for threads that Debian's have, and installs them into FOLDER, with what
# make_wheel.py asks for: copyright and version. Needs dpkg-dev, gfortran, make, libaec-dev, zlib1g-dev and the mirror
# of Debian that apt uses; not root.
set -euo pipefail

[ $# -eq 1 ] || { sed -n '2,7s/^# \?//p' "$0"; exit 2; }
folder=$(realpath -m "$1")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# Lists of sources in a place of their own: those of this machine stay as they are.
mkdir -p lists/partial parts
key=/usr/share/keyrings/debian-archive-keyring.gpg
# shellcheck disable=SC2016
apt-get indextargets --format '$(SITE) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' |
  grep -E '/debian(-security)? ' | sort -u | sed "s|^|deb-src [signed-by=$key] |" >parts/debian.list
apt=(apt-get -qq -o "Dir::Etc::sourcelist=$work/none" -o "Dir::Etc::sourceparts=$work/parts"
  -o "Dir::State::lists=$work/lists" -o Dir::Cache::pkgcache= -o Dir::Cache::srcpkgcache= -o APT::Sandbox::User=root)
"${apt[@]}" update
"${apt[@]}" source hdf5 >source.log 2>&1 || { cat source.log; exit 1; }

cd hdf5-*/
if ! { ./configure --prefix="$folder" --disable-dependency-tracking --disable-static --disable-hl --disable-tools \
    --disable-tests --enable-build-mode=production --enable-fortran --enable-unsupported --enable-threadsafe \
    --with-szlib --with-default-api-version=v18 --disable-ros3-vfd --disable-embedded-libinfo \
    --disable-sharedlib-rpath && make -j "${JOBS:-2}" && make install; } >"$work/build.log" 2>&1; then
  tail -n 20 "$work/build.log"
  exit 1
fi
mkdir -p "$folder/share/doc/hdf5"
cp debian/copyright "$folder/share/doc/hdf5/"
echo "hdf5 $(dpkg-parsechangelog --show-field Version)" >"$folder/share/doc/hdf5/version"
echo "$folder: $(cat "$folder/share/doc/hdf5/version"), without S3"
