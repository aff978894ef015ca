#!/usr/bin/env bash
# Kills the daemon again and again while it records and publishes, and checks what it leaves (tests/system/crash_cycles.py).
# usage: tools/crash_cycles.sh [--cycles N] [--seed S] [--kept-ms MS]
#   --cycles N   number of kills; 100: about 4 minutes
#   --seed S     of the instants and of the orders before them
#   --kept-ms MS the most that may be missing of a take (100); more on a busy machine
# exit codes: 0 all is well, 64 wrong command line, 65 an invariant was violated, 69 no program, 77 no network namespace allowed
set -euo pipefail
cd "$(dirname "$0")/.."
bin=${MOCAP_BIN_DIR:-$PWD/build/release/bin}
for program in mocapd mocapctl; do
  [ -x "$bin/$program" ] || { echo "crash_cycles: '$bin/$program' is missing; run tools/build.sh, or set MOCAP_BIN_DIR" >&2; exit 69; }
done
export MOCAP_BIN_DIR=$bin MOCAP_BUILD_DIR=${MOCAP_BUILD_DIR:-$(dirname "$bin")}
exec tools/own_network.sh /usr/bin/python3 -W ignore tests/system/crash_cycles.py "$@"
