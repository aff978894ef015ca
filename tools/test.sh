#!/usr/bin/env bash
# Installs what is needed, builds and runs all tests. Ends as ctest ends.
#
# usage: tools/test.sh [--preset release|asan|tsan] [ARGUMENTS OF CTEST ...]
set -euo pipefail
cd "$(dirname "$0")/.."

preset=release
if [ "${1:-}" = "--preset" ]; then
  preset=${2:?test: --preset needs release, asan or tsan}
  shift 2
fi

tools/setup.sh
cmake --preset "$preset" >/dev/null
cmake --build --preset "$preset"
# The closing lines go to standard output: how many passed, which failed, which were skipped.
ctest --preset "$preset" -j "$(nproc)" "$@"
