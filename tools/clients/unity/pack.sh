#!/usr/bin/env bash
# Creates the UPM package org.mocapd.unity-VERSION.tgz for "Add package from tarball" in Unity's Package Manager. The
# package contains the C# client, the native libraries that are given, and a .meta file for each file.
#
# usage: tools/clients/unity/pack.sh OUTPUT_FOLDER [--windows FOLDER] [LIBMOCAP_CLIENT.SO]
#   LIBMOCAP_CLIENT.SO   the C library for Linux, x86_64
#   --windows FOLDER     a folder with mocap_client.dll and the DLLs that mocap_client.dll needs, x86_64
# example: tools/clients/unity/pack.sh . build/release/lib/libmocap_client.so
set -euo pipefail

usage() { sed -n '2,8s/^# \{0,1\}//p' "$0"; }
refuse() { echo "pack: $1" >&2; exit "$2"; }

output='' windows='' linux=''
while [ $# -gt 0 ]; do
  case "$1" in
    -h | --help) usage; exit 0 ;;
    --windows) [ $# -gt 1 ] || refuse "--windows needs a folder" 64; windows=$2; shift ;;
    -*) refuse "unknown option '$1', expected --windows FOLDER" 64 ;;
    *) if [ -z "$output" ]; then output=$1; elif [ -z "$linux" ]; then linux=$1; else refuse "one library too many: '$1'" 64; fi ;;
  esac
  shift
done
[ -n "$output" ] || { usage >&2; exit 64; }
[ -n "$linux$windows" ] || refuse "no native library: give libmocap_client.so, or --windows FOLDER, or both" 64
[ -d "$output" ] || refuse "'$output' is not a folder" 66
[ -z "$linux" ] || [ -f "$linux" ] || refuse "'$linux' does not exist; build the target mocap_client first" 66
[ -z "$windows" ] || [ -f "$windows/mocap_client.dll" ] || refuse "'$windows' has no mocap_client.dll" 66

here=$(cd "$(dirname "$0")" && pwd)
output=$(cd "$output" && pwd)
version=$(sed -n 's/.*"version": "\(.*\)".*/\1/p' "$here/package.json")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
package=$folder/package
plugins=$package/Runtime/Plugins/x86_64
mkdir -p "$package"
cp -r "$here/package.json" "$here/README.md" "$here/CHANGELOG.md" "$here/Runtime" "$here/Editor" "$here/Samples~" "$package/"
cp "$here/../../../LICENSE" "$package/LICENSE.md"
cp "$here/../third_party.md" "$package/Third Party Notices.md"
find "$here/../csharp" -maxdepth 1 -name '*.cs' ! -name '*Example.cs' -exec cp {} "$package/Runtime/" \;
mkdir -p "$plugins"
[ -z "$linux" ] || cp -L "$linux" "$plugins/libmocap_client.so"
[ -z "$windows" ] || find -L "$windows" -maxdepth 1 -name '*.dll' -exec cp -L {} "$plugins/" \;
"$here/meta.py" "$package"
# The same input gives the same bytes.
find "$package" -exec chmod u=rwX,go=rX {} +
tar -C "$folder" --sort=name --owner=0 --group=0 --numeric-owner --mtime='2000-01-01 00:00:00Z' -cf - package | gzip -n9 \
  >"$output/org.mocapd.unity-$version.tgz"
echo "$output/org.mocapd.unity-$version.tgz"
