#!/usr/bin/env bash
# Creates OUTPUT_FOLDER/MocapLiveLink: the Unreal plugin with the client library in its folder ThirdParty. Copy it into the folder
# Plugins of a project.
#
# usage: tools/clients/unreal/pack.sh OUTPUT_FOLDER [--windows FOLDER] [LIBMOCAP_CLIENT.SO]
#   LIBMOCAP_CLIENT.SO   the C library for Linux, x86_64
#   --windows FOLDER     a folder with mocap_client.dll and the DLLs that mocap_client.dll needs, x86_64
# example: tools/clients/unreal/pack.sh . build/release/lib/libmocap_client.so
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
plugin=$(cd "$output" && pwd)/MocapLiveLink
[ ! -e "$plugin" ] || refuse "'$plugin' exists; remove it or choose another folder" 73
client=$plugin/ThirdParty/mocap_client
cp -r "$here/MocapLiveLink" "$plugin"
cp "$here/README.md" "$here/retarget.svg" "$plugin/"
mkdir -p "$client/include"
cp "$here/../c/mocap_client.h" "$client/include/"
cp "$here/../third_party.md" "$client/LICENSES.md"
cp "$here/../../../LICENSE" "$plugin/"
if [ -n "$linux" ]; then
  mkdir -p "$client/lib/Linux"
  cp -L "$linux" "$client/lib/Linux/libmocap_client.so"
fi
if [ -n "$windows" ]; then
  mkdir -p "$client/lib/Win64"
  find -L "$windows" -maxdepth 1 -name '*.dll' -exec cp -L {} "$client/lib/Win64/" \;
fi
echo "$plugin"
