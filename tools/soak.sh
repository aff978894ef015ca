#!/usr/bin/env bash
# Runs a studio of real programs for minutes or hours, with a fault a minute (tests/soak/README.md).
# usage: tools/soak.sh --minutes M | --hours H [--seed S] [--cameras N] [--subscribers N] [--report FOLDER] ...; see --help
# exit codes: 0 all is well, 64 wrong command line, 65 an invariant was violated, 69 no program, 77 no namespace allowed
set -euo pipefail
cd "$(dirname "$0")/.."
bin=${MOCAP_BIN_DIR:-$PWD/build/release/bin}
for program in mocapd mocapctl mocap-sim mocap-web mocap-vmc; do
  [ -x "$bin/$program" ] || { echo "soak: '$bin/$program' is missing; run tools/build.sh, or set MOCAP_BIN_DIR" >&2; exit 69; }
done
unshare --mount true 2>/dev/null || { echo "soak: the system allows no mount namespace; run as root" >&2; exit 77; }
export MOCAP_BIN_DIR=$bin MOCAP_BUILD_DIR=${MOCAP_BUILD_DIR:-$(dirname "$bin")}
exec tools/own_network.sh unshare --mount /usr/bin/python3 -W ignore tests/soak/soak.py "$@"
