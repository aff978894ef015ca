#!/usr/bin/env bash
# Runs the whole system on this machine: simulated GigE Vision cameras, the daemon and the live feed. Then scores the feed
# against the simulator's truth. Exit code 0 only if labelled skeletons arrived and match the truth.
set -euo pipefail
cd "$(dirname "$0")/.."

seconds=15
usage() {
  cat <<'TEXT'
usage: tools/demo.sh [--seconds N]

  --seconds N   duration of the live feed (default 15, at least 5)

Installs what is missing (as root), builds, starts 4 simulated GigE cameras (640x480, 60 fps) of a walking subject,
mocapd with config/demo.toml and the page, shows the feed, ends all processes that it started and prints the comparison of
the feed with the truth.
TEXT
}
while [ $# -gt 0 ]; do
  case "$1" in
    --seconds) seconds="${2:-}"; shift 2 || { usage >&2; exit 64; } ;;
    --seconds=*) seconds="${1#*=}"; shift ;;
    -h|--help) usage; exit 0 ;;
    *) echo "demo: unknown argument '$1'" >&2; usage >&2; exit 64 ;;
  esac
done
case "$seconds" in ''|*[!0-9]*) echo "demo: --seconds is '$seconds', expected a whole number from 5" >&2; exit 64 ;; esac
seconds=$((10#$seconds))  # 08 is no octal number
[ "$seconds" -ge 5 ] || { echo "demo: --seconds is $seconds, expected at least 5" >&2; exit 64; }

pids=()
finish() {
  for pid in "${pids[@]}"; do kill -TERM "$pid" 2>/dev/null || true; done
  for pid in "${pids[@]}"; do wait "$pid" 2>/dev/null || true; done
}
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
bin=build/release/bin

# Starts mocap-web, and waits for its address, which is the first line of its log.
start_page() {  # OPTION...
  "$bin/mocap-web" "ipc://$work/feed" "$@" >"$work/web.log" 2>&1 &
  local page=$!
  pids+=("$page")
  until grep -q 'http' "$work/web.log"; do
    kill -0 "$page" 2>/dev/null || return 1
    sleep 0.1
  done
}

# The page is for the browser, so it stays in the network of this machine; the rest runs in a network of its own. A Unix socket connects
# them.
if [ -z "${MOCAP_DEMO:-}" ]; then
  tools/build.sh mocapd mocap-sim mocap-watch mocap-score mocap-web mocapctl
  work=$(mktemp -d "${TMPDIR:-/tmp}/mocap-demo.XXXXXX")
  trap 'finish; rm -rf "$work"' EXIT
  start_page || start_page --port 0 || { cat "$work/web.log" >&2; exit 70; }
  echo "demo: the page is at $(sed -n 's/^mocap-web: //p' "$work/web.log")"
  MOCAP_DEMO="$work" tools/own_network.sh tools/demo.sh --seconds "$seconds" &
  inner=$!
  pids=("$inner" "${pids[@]}")
  wait "$inner"
  exit
fi
work=$MOCAP_DEMO

# Prints the end of the log and exits if a program has ended unexpectedly.
must_run() {
  kill -0 "$1" 2>/dev/null && return
  echo "demo: $2 ended early; the end of its log:" >&2
  tail -n 20 "$3" >&2
  exit 70
}

endpoint=tcp://127.0.0.1:5570
"$bin/mocap-sim" --serve --rig config/demo.rig.toml --motion tpose:2,walk --write-truth "$work/truth.jsonl" \
  >"$work/sim.log" 2>&1 &
sim=$!
pids+=("$sim")
source=$(pwd | sed 's/[#&\]/\\&/g')  # in the replacement of sed
{
  sed "s#\"demo.rig.toml\"#\"$source/config/demo.rig.toml\"#; s#\"markersets/#\"$source/config/markersets/#" config/demo.toml
  printf '[publish]\nmore_endpoints = ["ipc://%s/feed"]\n[control]\nmore_endpoints = ["ipc://%s/feed.control"]\n' "$work" "$work"
} >"$work/demo.toml"
"$bin/mocapd" --config "$work/demo.toml" >"$work/daemon.log" 2>&1 &
daemon=$!
pids+=("$daemon")
"$bin/mocap-watch" "$endpoint" --json --seconds "$((seconds + 30))" >"$work/stream.jsonl" 2>"$work/recorder.log" &
recorder=$!
pids+=("$recorder")

must_run "$sim" mocap-sim "$work/sim.log"
must_run "$daemon" mocapd "$work/daemon.log"
echo "demo: 4 simulated GigE cameras -> mocapd -> $endpoint, for $seconds s"
"$bin/mocap-watch" "$endpoint" --seconds "$seconds" || { must_run "$sim" mocap-sim "$work/sim.log"; must_run "$daemon" mocapd "$work/daemon.log"; }

kill -TERM "$recorder" "$daemon" 2>/dev/null || true
wait "$recorder" "$daemon" 2>/dev/null || true
kill -TERM "$sim" 2>/dev/null || true
wait "$sim" 2>/dev/null || true
grep -E ' (warn |error) ' "$work/daemon.log" || true

if "$bin/mocap-score" --truth "$work/truth.jsonl" --stream "$work/stream.jsonl" --require-match \
  --min-complete-share 0.99; then
  echo "demo: labelled skeletons arrived and match the truth"
else
  echo "demo: the feed does not match the truth" >&2
  exit 1
fi
