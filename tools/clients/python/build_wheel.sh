#!/usr/bin/env bash
# Builds the wheel mocap_client-VERSION-py3-none-any.whl: the package mocap_client and the messages mocap.v1, pure Python. Needs
# no network, but protoc and Debian's python3-pip, python3-setuptools and python3-wheel. Prints the path of the wheel.
#
# usage: tools/clients/python/build_wheel.sh [OUTPUT_FOLDER]     default: the current folder
#        python3 -m venv --system-site-packages venv             # with Debian's python3-zmq, python3-protobuf, python3-numpy;
#                                                                # without --system-site-packages pip fetches them
#        venv/bin/pip install mocap_client-*.whl
#
# PYTHON: the interpreter that builds; default /usr/bin/python3
set -euo pipefail

case "${1:-}" in
  -h|--help) sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//p}' "$0"; exit 0 ;;
  -*) echo "build_wheel: unknown argument '$1', expected a folder or nothing" >&2; exit 64 ;;
esac
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "${1:-.}"
output=$(cd "${1:-.}" && pwd)
python=${PYTHON:-/usr/bin/python3}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# setuptools writes into the folder that it builds: a copy. setup.py finds the messages at ../../../proto.
mkdir -p "$folder/tools/clients"
cp -r "$here" "$folder/tools/clients/python"
rm -rf "$folder"/tools/clients/python/{build,*.egg-info}
cp -r "$here/../../../proto" "$folder/proto"
if ! "$python" -m pip wheel --quiet --no-build-isolation --no-deps --no-index --wheel-dir "$folder/wheel" \
    "$folder/tools/clients/python" >"$folder/log" 2>&1; then
  cat "$folder/log" >&2
  echo "build_wheel: failed; the packages python3-pip python3-setuptools python3-wheel protobuf-compiler are needed" >&2
  exit 70
fi
wheel=$(basename "$folder"/wheel/*.whl)
cp "$folder/wheel/$wheel" "$output/"
echo "$output/$wheel"
