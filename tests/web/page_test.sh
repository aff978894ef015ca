#!/usr/bin/env bash
# Builds the page and tests it: its modules in Node.js, the page in Chromium. Exit code 77 (skipped) without Node.js, esbuild,
# Chromium or npm's packages.
#
# usage: tests/web/page_test.sh [--screenshots OUTDIR]     --screenshots: pictures of every page instead of the tests
set -euo pipefail
cd "$(dirname "$0")"

skip() { echo "page_test: $1 is missing; tools/setup.sh --tests installs it" >&2; exit 77; }
for tool in node protoc esbuild; do command -v "$tool" >/dev/null || skip "$tool"; done
[ -d ../../tools/web/page/node_modules/three ] || skip "tools/web/page/node_modules"
[ -d npm/node_modules/ws ] || skip "tests/web/npm/node_modules"
[ -x "${MOCAP_CHROMIUM:-/usr/bin/chromium}" ] || skip "chromium"

MOCAP_PAGE_DIST=$(mktemp -d "${TMPDIR:-/tmp}/mocap-page.XXXXXX")
export MOCAP_PAGE_DIST
trap 'rm -rf "$MOCAP_PAGE_DIST"' EXIT
../../tools/web/page/build.sh "$MOCAP_PAGE_DIST"
case "${1:-}" in
  "") node --test model_test.mjs page_test.mjs ;;
  --screenshots) node screenshots.mjs "${2:?usage: page_test.sh --screenshots OUTDIR}" ;;
  *) echo "page_test: unknown argument '$1', expected --screenshots OUTDIR or nothing" >&2; exit 64 ;;
esac
