#!/usr/bin/env bash
# Runs the checks for a commit, which the build server also runs: format, include table, standard headers, links in
# Markdown, warnings, each header alone, shell scripts. tools/test.sh runs the tests.
#
# usage: tools/check.sh [--fix] [--tidy] [--all]
#   --fix    format the files instead of reporting them
#   --tidy   also run clang-tidy on the files that differ from the main branch (up to a minute each)
#   --all    with --tidy: on every file
set -uo pipefail
cd "$(dirname "$0")/.." || exit 70

all=false
fix=false
with_tidy=false
for argument in "$@"; do
  case "$argument" in
    --all) all=true ;;
    --fix) fix=true ;;
    --tidy) with_tidy=true ;;
    -h | --help) sed -n '2,8s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "check: unknown argument '$argument', expected --fix, --tidy or --all" >&2; exit 64 ;;
  esac
done

failed=()
# Runs one check and continues after a failure, so that all faults are reported at once.
check() {
  local name=$1
  shift
  echo "check: $name"
  "$@" || failed+=("$name")
}

# Lists the matching files that git tracks, and new files that git does not ignore.
files() { git ls-files --cached --others --exclude-standard -- "$@" | sort -u | while read -r file; do [ -f "$file" ] && echo "$file"; done; }

# Lists the matching files that differ from the merge base with the main branch; all files if there is no merge base.
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

# A file that was built before is not compiled again and gives no warning. The build server compiles every file.
build() {
  local log
  log=$(mktemp)
  cmake --preset release -DBUILD_TESTING=ON >/dev/null && cmake --build --preset release | tee "$log"
  local status=$?
  if grep -q 'warning:' "$log"; then
    echo "check: the build has warnings" >&2
    status=1
  fi
  rm -f "$log"
  return $status
}

headers_alone() { cmake --build build/release --target headers_alone; }

tidy() {
  local sources
  mapfile -t sources < <(changed 'daemon/*.cpp' 'tools/*.cpp')
  if [ ${#sources[@]} -eq 0 ]; then
    echo "check: no changed source file for clang-tidy"
    return 0
  fi
  echo "check: ${#sources[@]} source files, up to a minute each"
  # clang-tidy needs the command of each file, and cannot read the precompiled header of g++. Without that header, missing
  # includes are found too.
  cmake --preset release -B build/tidy -DMOCAP_BATCHES=OFF -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON >/dev/null
  printf '%s\n' "${sources[@]}" | xargs -P "$(nproc)" -n 1 clang-tidy --quiet -p build/tidy 2>&1 |
    sed -E '/^[0-9]+ warnings? (generated|treated as errors)|^Suppressed|^Use -header-filter/d'
}

shell_scripts() { files '*.sh' '.ci/run' | xargs shellcheck; }

commit_names() {
  # The style: "folder: what it does now", under 60 characters.
  local long
  long=$(git log --format=%s main..HEAD 2>/dev/null | grep -v '^Merge ' | awk 'length($0) > 60' || true)
  [ -z "$long" ] || { echo "over 60 characters: $long" >&2; return 1; }
}

check format format
check "include table" tests/layers.py
check "standard headers of headers" tests/std_includes.py
check "links in Markdown" tests/links.py
check "build, warnings are errors" build
check "each header compiles alone" headers_alone
$with_tidy && check clang-tidy tidy
if command -v shellcheck >/dev/null; then
  check shellcheck shell_scripts
else
  echo "check: shellcheck is not installed; shell scripts are not checked"
fi
check "commit names" commit_names

if [ ${#failed[@]} -gt 0 ]; then
  printf 'check: failed: %s\n' "${failed[@]}" >&2
  exit 1
fi
echo "check: all checks passed"
