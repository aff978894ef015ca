#!/usr/bin/env bash
# Creates the NuGet package Mocapd.Client.VERSION.nupkg, and the folder Mocapd.Client.VERSION with the same files: the C# client
# (lib/netstandard2.0), the C library for Linux (runtimes/linux-x64/native) and, if given, for Windows
# (runtimes/win-x64/native). Needs Mono's compiler (mono-mcs) and zip. Prints the path of the package.
#
# usage: tools/clients/csharp/pack.sh OUTPUT_FOLDER LIBMOCAP_CLIENT_SO [--windows FOLDER]
#        FOLDER has mocap_client.dll
#        e.g. tools/clients/csharp/pack.sh . build/release/lib/libmocap_client.so
#        dotnet add package Mocapd.Client --source .           # in a project of .NET
set -euo pipefail

usage() { sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//p}' "$0"; }
fail() { echo "pack: $1" >&2; exit 64; }

arguments=()
windows=
while [ $# -gt 0 ]; do
  case "$1" in
    -h|--help) usage; exit 0 ;;
    --windows) [ $# -ge 2 ] || fail "--windows: expected a folder with mocap_client.dll"; windows=$2; shift ;;
    -*) fail "unknown argument '$1', see --help" ;;
    *) arguments+=("$1") ;;
  esac
  shift
done
[ ${#arguments[@]} -eq 2 ] || { usage >&2; exit 64; }
library=${arguments[1]}
[ -f "$library" ] || fail "$library: no such file; build it with tools/build.sh mocap_client"
[ -z "$windows" ] || [ -f "$windows/mocap_client.dll" ] || fail "$windows: has no mocap_client.dll"
for tool in mcs zip; do
  command -v $tool >/dev/null || { echo "pack: $tool is missing; apt install mono-mcs zip" >&2; exit 69; }
done

here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "${arguments[0]}"
output=$(cd "${arguments[0]}" && pwd)
version=$(sed -n 's/.*<version>\(.*\)<\/version>.*/\1/p' "$here/Mocapd.Client.nuspec")
package=$output/Mocapd.Client.$version
rm -rf "$package" "$package.nupkg"
mkdir -p "$package/lib/netstandard2.0" "$package/runtimes/linux-x64/native" "$package/_rels"
mcs -nologo -langversion:5 -warnaserror -optimize -target:library -out:"$package/lib/netstandard2.0/MocapClient.dll" \
  "$here"/Mocap*.cs
cp -L "$library" "$package/runtimes/linux-x64/native/libmocap_client.so"
if [ -n "$windows" ]; then
  mkdir -p "$package/runtimes/win-x64/native"
  cp "$windows/mocap_client.dll" "$package/runtimes/win-x64/native/"
fi
cp "$here/Mocapd.Client.nuspec" "$here/README.md" "$here/../../../LICENSE" "$package/"
# The two files that make the folder an OPC package.
cat >"$package/_rels/.rels" <<XML
<?xml version="1.0" encoding="utf-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
  <Relationship Type="http://schemas.microsoft.com/packaging/2010/07/manifest" Target="/Mocapd.Client.nuspec" Id="R1" />
</Relationships>
XML
cat >"$package/[Content_Types].xml" <<XML
<?xml version="1.0" encoding="utf-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
  <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml" />
  <Default Extension="nuspec" ContentType="application/octet" />
  <Default Extension="dll" ContentType="application/octet" />
  <Default Extension="so" ContentType="application/octet" />
  <Default Extension="md" ContentType="text/markdown" />
  <Override PartName="/LICENSE" ContentType="text/plain" />
</Types>
XML
(cd "$package" && find . -type f | LC_ALL=C sort | sed 's/^\.\///' | zip -q -X "$package.nupkg" -@)
echo "$package.nupkg"
