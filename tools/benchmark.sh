#!/bin/sh
# Runs the benchmarks of labels and skeletons on all recordings of the data folder and writes tools/eval/BENCHMARK.md.
# Usage: tools/benchmark.sh [--quick] [FOLDER]
#   --quick  noise none and soma, body given: under a minute; else 7 kinds of noise, 3 modes: 7 to 13 minutes beside a load of 11 to 14
#   FOLDER   C3D, TRC and BVH files of your own, run in addition
set -eu
cd "$(dirname "$0")/.."
eval_program=${MOCAP_BIN_DIR:-build/release/bin}/mocap-eval
data=${MOCAP_SHARED_DATA:-../shared/data}
noise=none,soma,hidden5,cuts50,studio,uniform10,uniform30
modes=given,calibrated,cold
seeds=1
skeleton_noise=none,solver
skeleton_s=20
own=
for argument; do
  case $argument in
    --quick) noise=none,soma modes=given seeds=1 skeleton_s=5 ;;
    -*) echo "tools/benchmark.sh: unknown option '$argument', expected --quick or a folder" >&2; exit 64 ;;
    *) own=$argument ;;
  esac
done
[ -x "$eval_program" ] || { echo "tools/benchmark.sh: '$eval_program' is missing; build mocap-eval, or set MOCAP_BIN_DIR" >&2; exit 69; }
result=$(mktemp)
failed=0
trap 'rm -f "$result"' EXIT
began=$(date +%s)

# run TITLE TAKE OPTIONS...: appends the table and the reasons; a take that is missing is told.
run() {
  title=$1 take=$2
  shift 2
  if [ ! -f "$take" ]; then
    echo "$title: '$take' is missing" >&2
    return
  fi
  echo "$title" >&2
  { printf '\n### %s\n\n```\n' "$title"
    "$eval_program" benchmark labels "$take" --noise "$noise" --seeds "$seeds" --reasons "$@" || failed=$?
    printf '```\n'; } >>"$result"
}

# run_skeletons TITLE MOTIONS...: the same for joints and rotations.
run_skeletons() {
  title=$1
  shift
  [ -f "$1" ] || return 0
  echo "$title" >&2
  { printf '\n### %s\n\n```\n' "$title"
    "$eval_program" benchmark skeleton "$@" --noise "$skeleton_noise" --seeds "$seeds" --seconds "$skeleton_s" --soft-tissue 8 \
      --marker-error 6 --size 0.95 --occlusion 8 || failed=$?
    printf '```\n'; } >>"$result"
}

c3d=$data/c3d
run "Kneel to prone, 62 markers, 240 Hz" "$c3d/aml_kneel_to_prone_240.c3d" --modes "$modes" --marker-set tools/eval/markersets/segments62.toml
run "The same, bones found by motion" "$c3d/aml_kneel_to_prone_240.c3d" --modes given
run "Ballet, 41 markers, 30 Hz" "$data/trc/btk_ballet_reduced.trc" --modes "$modes"
run "Gait, 33 markers, 100 Hz" "$c3d/btk_gait_cammask_100.c3d" --modes "$modes"
run "OptiTrack, 36 markers, 100 Hz" "$c3d/btk_optitrack36_100.c3d" --modes "$modes"
run "Plug-in Gait walk, 35 markers, 100 Hz" "$c3d/btk_pig_walk_fullbody_100.c3d" --modes "$modes,static" --static "$c3d/btk_pig_walk_static_100.c3d"
run "Movement among 42 ghosts, 39 markers, 120 Hz" "$c3d/pycgm_movement_42unlabelled_120.c3d" --modes "$modes,static" --static "$c3d/pycgm_static_38unlabelled_120.c3d"
run_skeletons "Skeletons, 41 markers, 120 Hz, soft tissue 8 mm, 8 cameras" "$data"/bvh/*.bvh
if [ -n "$own" ]; then
  for take in "$own"/*.c3d "$own"/*.trc; do
    [ -f "$take" ] && run "$(basename "$take")" "$take" --modes "$modes"
  done
  run_skeletons "Skeletons of $own" "$own"/*.bvh
fi

if [ "$failed" != 0 ] || [ ! -s "$result" ]; then
  echo "tools/benchmark.sh: no take was found, or one failed; tools/eval/BENCHMARK.md is as before" >&2
  exit 66
fi
{
  sed '/^<!-- measured -->$/q' tools/eval/benchmark_protocol.md
  printf '\nMachine: %s, %s cores (load %s at the end). Commit: %s. Noise: %s; %s seed(s). Duration: %s s.\n' \
    "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" "$(nproc)" "$(cut -d ' ' -f 1 /proc/loadavg)" \
    "$(git rev-parse --short HEAD 2>/dev/null || echo unknown)" "$noise" "$seeds" "$(($(date +%s) - began))"
  cat "$result"
} >tools/eval/BENCHMARK.md
echo "written: tools/eval/BENCHMARK.md" >&2
