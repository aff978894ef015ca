#!/usr/bin/env bash
# What a developer wants before a commit: format, layers, each header alone, warnings as errors, clang-tidy, shellcheck.
# Tests are tools/test.sh's.
#
# usage: tools/check.sh [--all] [--fix]
#   --all   clang-tidy on every file, not only on those that differ from the main branch (slow)
#   --fix   format the files instead of complaining
set -uo pipefail
cd "$(dirname "$0")/.." || exit 70

all=false
fix=false
for argument in "$@"; do
  case "$argument" in
    --all) all=true ;;
    --fix) fix=true ;;
    *) echo "check: unknown argument '$argument', expected --all or --fix" >&2; exit 64 ;;
  esac
done

failed=()
# Runs one check and goes on, so that all faults are told at once.
check() {
  local name=$1
  shift
  echo "check: $name"
  "$@" || failed+=("$name")
}

# As git sees them: tracked, or new and not ignored.
files() { git ls-files --cached --others --exclude-standard -- "$@" | sort -u | while read -r file; do [ -f "$file" ] && echo "$file"; done; }

# Those that differ from where this branch left the main one; all where there is no such place.
changed() {
  local base
  base=$(git merge-base HEAD main 2>/dev/null || git merge-base HEAD origin/main 2>/dev/null) || base=
  if $all || [ -z "$base" ]; then
    files "$@"
  else
    { git diff --name-only "$base" -- "$@"; git ls-files --others --exclude-standard -- "$@"; } |
      sort -u | while read -r file; do [ -f "$file" ] && echo "$file"; done
  fi
}

format() {
  if $fix; then
    files '*.h' '*.cpp' | xargs clang-format -i
  else
    files '*.h' '*.cpp' | xargs clang-format --dry-run -Werror
  fi
}

build() { cmake --preset release >/dev/null && cmake --build --preset release; }

headers_alone() { cmake --build build/release --target all_verify_interface_header_sets; }

tidy() {
  local sources
  mapfile -t sources < <(changed 'daemon/*.cpp' 'tools/*.cpp')
  if [ ${#sources[@]} -eq 0 ]; then
    echo "check: no changed source file for clang-tidy"
    return 0
  fi
  echo "check: ${#sources[@]} source files, up to a minute each"
  # Another compiler cannot read what g++ has precompiled; without it, what a file forgot to include is seen too.
  mkdir -p build/release/tidy
  sed -E 's/-Winvalid-pch -include [^ ]+|-fpch-preprocess//g' build/release/compile_commands.json >build/release/tidy/compile_commands.json
  printf '%s\n' "${sources[@]}" | xargs -P "$(nproc)" -n 1 clang-tidy --quiet -p build/release/tidy 2>&1 |
    sed -E '/^[0-9]+ warnings? (generated|treated as errors)|^Suppressed|^Use -header-filter/d'
}

shell_scripts() { files '*.sh' '.ci/run' | xargs shellcheck; }

commit_names() {
  # The style: "room: what it does now", under 60 characters.
  local long
  long=$(git log --format=%s main..HEAD 2>/dev/null | grep -v '^Merge ' | awk 'length($0) > 60' || true)
  [ -z "$long" ] || { echo "over 60 characters: $long" >&2; return 1; }
}

check format format
check layers tests/layers.py
check "build, warnings are errors" build
check "each header compiles alone" headers_alone
check clang-tidy tidy
if command -v shellcheck >/dev/null; then
  check shellcheck shell_scripts
else
  echo "check: shellcheck is not installed, left out"
fi
check "commit names" commit_names

if [ ${#failed[@]} -gt 0 ]; then
  printf 'check: failed: %s\n' "${failed[@]}" >&2
  exit 1
fi
echo "check: all is well"
