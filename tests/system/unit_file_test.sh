#!/usr/bin/env bash
# Checks that systemd accepts every setting of the unit, and that the unit is well sandboxed. Skipped (77) without systemd.
set -euo pipefail
cd "$(dirname "$0")/../.."
command -v systemd-analyze >/dev/null || { echo "skipped: systemd-analyze is not installed (apt-get install systemd)"; exit 77; }

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Prints systemd's complaints about a unit under a name, with /bin/true as the program. systemd-analyze exits with 0 for unknown
# keys, so only its output counts.
complaints() {
  sed 's#/usr/bin/mocap[^ ]*#/bin/true#' "$1" >"$work/$2"
  systemd-analyze verify --man=no "$work/$2" 2>&1 | grep -F "$2" || true
}

# Checks that systemd accepts a unit, and that its exposure is at most the threshold, in tenths; 100 is root without
# restrictions.
check_unit() {
  local file=$1 name=$2 threshold=$3 said report
  said=$(complaints "$file" "$name")
  if [ -n "$said" ]; then
    echo "systemd does not understand the unit: $said" >&2
    exit 1
  fi
  cp "$file" "$work/$name"
  if ! report=$(systemd-analyze security --offline=true --threshold="$threshold" "$work/$name" 2>&1); then
    case "$report" in
      *"Unknown"* | *"unrecognized"*) echo "skipped: this systemd-analyze has no offline check"; exit 77 ;;
    esac
    echo "$name is more exposed than $threshold tenths:" >&2
    printf '%s\n' "$report" | grep -E '✗|→' >&2
    exit 1
  fi
  printf '%s\n' "$report" | tail -n 1
}

# Checks that systemd-analyze detects a fault.
sed 's/^WatchdogSec=/WatchdogSecs=/' systemd/mocapd.service >"$work/broken"
if [ -z "$(complaints "$work/broken" mocapd.service)" ]; then
  echo "systemd-analyze does not detect a misspelt key; this test is ineffective" >&2
  exit 1
fi

check_unit systemd/mocapd.service mocapd.service 20  # camera and sound devices, network and real time
check_unit systemd/mocap-bridge@.service mocap-bridge@vrpn.service 13  # network
check_unit systemd/mocap-web.service mocap-web.service 13  # network
