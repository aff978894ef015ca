#!/usr/bin/env bash
# Makes the UPM package: org.mocapd.unity-VERSION.tgz, for "Add package from tarball" in Unity's Package Manager. The C#
# client and the native libraries given go into it.
#
# usage: tools/clients/unity/pack.sh OUTPUT_FOLDER NATIVE_LIBRARY...
#        e.g. pack.sh . build/release/lib/libmocap_client.so mocap_client.dll
set -euo pipefail

if [ $# -lt 2 ]; then
  sed -n '2,7s/^# \{0,1\}//p' "$0" >&2
  exit 64
fi
here=$(cd "$(dirname "$0")" && pwd)
output=$(cd "$1" && pwd)
shift
version=$(sed -n 's/.*"version": "\(.*\)".*/\1/p' "$here/package.json")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir -p "$folder/package/Runtime/Plugins"
cp "$here/package.json" "$here/README.md" "$folder/package/"
find "$here/Runtime" -maxdepth 1 -type f -exec cp {} "$folder/package/Runtime/" \;
cp "$here/../csharp/MocapClient.cs" "$folder/package/Runtime/"
for library in "$@"; do
  cp -L "$library" "$folder/package/Runtime/Plugins/"
done
tar -C "$folder" --sort=name --owner=0 --group=0 -czf "$output/org.mocapd.unity-$version.tgz" package
echo "$output/org.mocapd.unity-$version.tgz"
