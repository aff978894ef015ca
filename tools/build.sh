#!/usr/bin/env bash
# Installs the packages that the build needs, and builds all programs, the Python module of the feed's messages and the client
# libraries, without the tests. An existing configuration of build/release is kept.
#
# usage: tools/build.sh [TARGET...]     without a TARGET: everything
set -euo pipefail
cd "$(dirname "$0")/.."

case "${1:-}" in
  -h|--help) sed -n '2,/^set/s/^# \{0,1\}//p' "$0"; exit 0 ;;
  -*) echo "build: unknown argument '$1', expected names of targets or nothing" >&2; exit 64 ;;
esac

tools/setup.sh
[ -f build/release/build.ninja ] || cmake --preset release -DBUILD_TESTING=OFF
cmake --build --preset release ${1:+--target "$@"}
