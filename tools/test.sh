#!/usr/bin/env bash
# Installs the packages of build and tests, builds, and runs all tests. Exit code: that of ctest.
#
# usage: tools/test.sh [--preset release|asan|tsan] [ARGUMENTS OF CTEST ...]
set -euo pipefail
cd "$(dirname "$0")/.."

preset=release
if [ "${1:-}" = "--preset" ]; then
  preset=${2:?test: --preset needs release, asan or tsan}
  shift 2
fi

tools/setup.sh --tests
cmake --preset "$preset" -DBUILD_TESTING=ON >/dev/null
cmake --build --preset "$preset"
# One test more than processors: a system test waits a third of its time. The last lines of the output list failed and skipped
# tests, and why they failed.
code=0
ctest --preset "$preset" -j "$(($(nproc) + 1))" "$@" || code=$?
tests/why_failed.py "build/$preset"
exit "$code"
