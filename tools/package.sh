#!/usr/bin/env bash
# Builds the Debian packages mocapd, mocap-tools, libmocap-client1, libmocap-client-dev and python3-mocap-client.
set -euo pipefail
cd "$(dirname "$0")/.."

usage() {
  cat <<'TEXT'
usage: tools/package.sh [--out DIR] [--revision N] [--no-lintian]

  --out DIR       folder of the packages (default build/packages); older packages in it are removed
  --revision N    Debian revision, the N of version 0.1.0-N (default 1): a higher one upgrades an installed package
  --no-lintian    do not check the packages

Installs what is missing (as root), builds the programs in build/release unless they are up to date, and packs them. Packages with
the symbols of the programs, for core dumps, go to DIR/debug. lintian checks all packages; a warning is an error. Beside each package
is its bill of materials, PACKAGE.spdx.json (SPDX 2.3).

examples:
  tools/package.sh && sudo apt install ./build/packages/*.deb
      the service runs with simulated cameras; /etc/mocapd/mocapd.toml says how to use yours
  tools/package.sh --revision 2 --out /tmp/packages
      the same version packed once more, for machines that have revision 1

exit codes: 0 done, 64 wrong command line, 65 lintian has complaints, 69 a needed package is missing, 70 the build failed
TEXT
}

fail() {  # CODE TEXT
  echo "package: $2" >&2
  exit "$1"
}

out=build/packages
revision=1
lintian=true
while [ $# -gt 0 ]; do
  case "$1" in
    --out) out=${2:-}; shift 2 || fail 64 "--out needs a folder; see --help" ;;
    --out=*) out=${1#*=}; shift ;;
    --revision) revision=${2:-}; shift 2 || fail 64 "--revision needs a whole number; see --help" ;;
    --revision=*) revision=${1#*=}; shift ;;
    --no-lintian) lintian=false; shift ;;
    -h | --help) usage; exit 0 ;;
    *) fail 64 "unknown argument '$1'; see --help" ;;
  esac
done
[ -n "$out" ] || fail 64 "--out is empty, expected a folder"
[[ $revision =~ ^[1-9][0-9]*$ ]] || fail 64 "--revision is '$revision', expected a whole number from 1"

began=$SECONDS
step() { echo "package: $1 ($((SECONDS - began)) s so far)"; }

# Runs a command quietly. If the command fails, prints the end of its output and ends with 70.
quietly() {
  "$@" >"$work/log" 2>&1 && return
  tail -n 30 "$work/log" >&2
  fail 70 "'$*' failed; the end of its output is above"
}

# The one version of the project, and the time of its last commit, so that the same source gives the same packages.
version=$(sed -n 's/^project(mocapd VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
[ -n "$version" ] || fail 70 "CMakeLists.txt: no line project(mocapd VERSION ...)"
version+=-$revision
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct 2>/dev/null || stat --format=%Y CMakeLists.txt)
export SOURCE_DATE_EPOCH

tools/setup.sh --packages
step "programs"
tools/build.sh programs

work=$(mktemp -d "${TMPDIR:-/tmp}/mocap-package.XXXXXX")
trap 'rm -rf "$work"' EXIT
source=$work/mocapd
mkdir -p "$source" "$out/debug"
# The packaging is in debian/ of a copy, because dpkg-buildpackage searches there.
tar --create --exclude=./build --exclude=./.git --exclude=__pycache__ . | tar --extract --directory "$source"
cp -r tools/debian "$source/debian"
cat >"$source/debian/changelog" <<END
mocapd ($version) unstable; urgency=medium

  * Packages of this version.

 -- $(sed -n 's/^Maintainer: //p' tools/debian/control)  $(date --utc --rfc-email --date="@$SOURCE_DATE_EPOCH")
END

step "packages $version"
cd "$source"
export MOCAP_BUILD=$OLDPWD/build/release
quietly dpkg-buildpackage --build=binary --unsigned-changes --no-pre-clean
cd "$OLDPWD"
if $lintian; then
  step "lintian"
  # Not faults here: initial-upload-closes-no-bugs, because the packages are not uploaded to Debian; debug-file-with-no-debug-symbols,
  # because the release build has the names of functions and no lines. --allow-root: otherwise lintian warns of itself.
  lintian --allow-root --fail-on error,warning \
    --suppress-tags initial-upload-closes-no-bugs,debug-file-with-no-debug-symbols "$work"/*.changes || fail 65 "lintian has complaints"
fi
# Only one version stays in the folder, so that `apt install DIR/*.deb` is clear.
sed -n 's/^Package: //p' tools/debian/control | while read -r package; do
  rm -f "$out/$package"_*.deb "$out/$package"_*.spdx.json "$out/debug/$package"-dbgsym_*.deb
done
mv "$work"/*-dbgsym_*.deb "$out/debug"
mv "$work"/*.deb "$out"
tools/debian/sbom.py "$out"/*_"$version"_*.deb
step "packages in $out"
ls -sh "$out"/*_"$version"_*.deb
