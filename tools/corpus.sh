#!/usr/bin/env bash
# Checks the corpus of recordings (tests/corpus) against its frozen figures.
set -euo pipefail
cd "$(dirname "$0")/.."

usage() {
  cat <<'TEXT'
usage: tools/corpus.sh [--rewrite REASON | --make FOLDER]

  (no option)        builds mocap-corpus in build/release and compares the figures of all recordings with tests/corpus/table.tsv
  --rewrite REASON   the figures of today become the frozen ones; the reason is in the table and belongs into the commit
  --make FOLDER      simulates all recordings anew into an empty folder; the same source makes the same recordings

examples:
  tools/corpus.sh
      lists each recording that differs; only the number of differing hashes is printed; lines "error take" are of two recordings
      whose disk fails on purpose
  tools/corpus.sh --rewrite "label: limbs return one set earlier" && git add tests/corpus/table.tsv
      after a change that is meant to change labels; git diff shows which recordings

exit codes: 0 as frozen, 64 wrong command line, 65 a figure differs, 66 a file cannot be read, 70 the build failed, 73 cannot write
TEXT
}

wrong() {  # TEXT
  echo "corpus: $1; see --help" >&2
  exit 64
}

command=(check tests/corpus)
case "${1:-}" in
  "") ;;
  -h | --help) usage; exit 0 ;;
  --rewrite) [ -n "${2:-}" ] || wrong "--rewrite needs a reason"; command=(rewrite tests/corpus "$2") ;;
  --make) [ -n "${2:-}" ] || wrong "--make needs an empty folder"; mkdir -p "$2"; command=(make "$2") ;;
  *) wrong "unknown argument '$1'" ;;
esac

cmake --preset release -DBUILD_TESTING=ON >/dev/null && cmake --build --preset release --target mocap-corpus >/dev/null || exit 70
exec build/release/bin/mocap-corpus "${command[@]}"
