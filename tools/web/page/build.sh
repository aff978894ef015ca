#!/usr/bin/env bash
# Checks the page's types and bundles the page: index.html, app.js, app.css, icon.svg.
#
# usage: tools/web/page/build.sh OUTDIR
#
# Needs protoc, esbuild and the packages of package-lock.json (npm ci --ignore-scripts; tools/setup.sh installs all three).
# Exit code 69 if one is missing.
set -euo pipefail
[ $# -eq 1 ] || { echo "usage: build.sh OUTDIR" >&2; exit 64; }
mkdir -p "$1"
out=$(cd "$1" && pwd)
cd "$(dirname "$0")"

for tool in protoc esbuild node; do
  command -v "$tool" >/dev/null || { echo "build.sh: $tool is missing, expected in PATH; tools/setup.sh installs it" >&2; exit 69; }
done
[ -d node_modules/three ] || { echo "build.sh: tools/web/page/node_modules is missing; make it with: npm ci --prefix tools/web/page --ignore-scripts" >&2; exit 69; }

# gen/ is shared by all builds of this work tree. A file is replaced only if it differs.
exec 9<.
flock 9
fresh=$(mktemp -d)
trap 'rm -rf "$fresh"' EXIT
protoc -I ../../../proto --plugin=protoc-gen-es=node_modules/.bin/protoc-gen-es --es_out="$fresh" --es_opt=target=ts \
  ../../../proto/mocap/v1/*.proto
mkdir -p gen
diff -rq "$fresh" gen >/dev/null 2>&1 || { rm -rf gen && cp -r "$fresh" gen; }

node_modules/.bin/tsc --noEmit
esbuild src/main.tsx --bundle --minify --format=esm --target=es2021 --legal-comments=none --jsx=automatic \
  --jsx-import-source=preact --log-level=warning --outfile="$out/app.js"
cp static/index.html static/icon.svg "$out"
