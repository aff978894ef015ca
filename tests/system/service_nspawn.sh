#!/usr/bin/env bash
# The service on a real systemd, booted in a container over this machine's own files (nothing of it is changed): ready
# only when it runs, status, real time and locked memory or a clear warning, watchdog, restart, stop, and no restart of
# what a restart does not cure. Synthetic cameras. Skipped (77) where no such container can be had.
#
#   service_nspawn.sh BIN_DIR
set -euo pipefail

skip() {
  echo "service_nspawn: skipped: $*"
  exit 77
}

# --- inside of the container ------------------------------------------------------------------------------------------

failures=0
expect() {  # WHAT COMMAND...: the command succeeds
  local what=$1
  shift
  if "$@"; then echo "ok   $what"; else
    echo "FAIL $what"
    failures=$((failures + 1))
  fi
}
show() { systemctl show mocapd --property="$1" --value; }
matches() { [[ "$1" =~ $2 ]]; }
within_s() {  # SECONDS COMMAND...: the command succeeds by then
  local until=$((SECONDS + $1))
  shift
  until "$@"; do
    [ $SECONDS -lt "$until" ] || return 1
    sleep 0.1
  done
}
status_is() { matches "$(show StatusText)" "$1"; }
restarted() { [ "$(show NRestarts)" -ge "$1" ] && [ "$(show ActiveState)" = active ]; }
journal_has() { journalctl --unit mocapd --output cat --priority "$1" | grep -qE -- "$2"; }
policies() { for thread in /proc/"$(show MainPID)"/task/*; do chrt --pid "${thread##*/}"; done; }
fifo_threads() { [ "$(policies | grep -c SCHED_FIFO)" -ge "$1" ]; }
locked_kb() { awk '/^VmLck/ {print $2}' /proc/"$(show MainPID)"/status; }
alive_with_all_cameras='cameras=4 of 4 sets=[1-9][0-9.]*/s complete=[0-9.]+% sent='

check_start() {
  systemctl start mocapd
  expect "active when start returns" [ "$(show ActiveState)" = active ]
  expect "says that it is ready before it has images" status_is 'waiting|cameras='
  expect "the status tells cameras and rates" within_s 10 status_is "$alive_with_all_cameras"
  echo "     $(show StatusText)"
  expect "the feed comes" mocap-watch --seconds 10 --frames 10 --summary /dev/null
  expect "start-up stands in the journal as information" journal_has info..info 'mocapd: started, cameras=4'
  expect "its id is its own" matches "$(stat -c %U /proc/"$(show MainPID)")" '^(mocapd|[0-9]+)$'
}

check_real_time() {
  if [[ "$(show LimitRTPRIO)" -gt 0 ]] && [ "$(ulimit -Hr)" != 0 ]; then
    expect "SCHED_FIFO by the unit's limits" matches "$(policies)" 'SCHED_FIFO'
    expect "locked memory by the unit's limits" [ "$(locked_kb)" -gt 10000 ]
  else
    echo "note this machine raises no limits: the warnings are looked at instead"
    expect "refused priority is a warning with its cure" journal_has warning..warning 'fusion: SCHED_FIFO.*LimitRTPRIO'
    expect "refused memory is a warning with its cure" journal_has warning..warning 'memory.*LimitMEMLOCK=infinity'
  fi
  # The capabilities do what the limits do; the rest of the unit must not stand in the way.
  mkdir -p /run/systemd/system/mocapd.service.d
  printf '[Service]\n%s=CAP_NET_RAW CAP_SYS_NICE CAP_IPC_LOCK\n%s=CAP_NET_RAW CAP_SYS_NICE CAP_IPC_LOCK\n' \
    CapabilityBoundingSet AmbientCapabilities >/run/systemd/system/mocapd.service.d/allow.conf
  systemctl daemon-reload
  systemctl restart mocapd
  expect "SCHED_FIFO within the unit's walls" within_s 5 fifo_threads 6
  expect "locked memory within the unit's walls" [ "$(locked_kb)" -gt 10000 ]
}

# Stops one thread of the daemon, as a debugger does, until the daemon is gone.
hold_thread() {
  local thread
  thread=$(grep -lx "$1" /proc/"$(show MainPID)"/task/*/comm)
  thread=${thread%/comm}
  /usr/bin/python3 - "${thread##*/}" <<'END' &
import ctypes, os, sys
seize, interrupt = 0x4206, 0x4207  # PTRACE_SEIZE, PTRACE_INTERRUPT, ptrace(2)
thread, libc = int(sys.argv[1]), ctypes.CDLL(None)
assert libc.ptrace(seize, thread, None, None) == 0
assert libc.ptrace(interrupt, thread, None, None) == 0
wait_for_threads = 0x40000000  # __WALL
while not os.WIFSIGNALED(os.waitpid(thread, wait_for_threads)[1]):
    pass
END
}

check_failures() {
  expect "all is well before it" within_s 10 status_is "$alive_with_all_cameras"
  local before=$SECONDS
  kill -STOP "$(show MainPID)"
  expect "a daemon that stands still is ended and started anew" within_s 15 restarted 1
  expect "by the watchdog" journal_has warning 'Watchdog timeout|result .watchdog.'
  expect "not before its patience" [ $((SECONDS - before)) -ge 3 ]
  expect "all is well again" within_s 10 status_is "$alive_with_all_cameras"
  hold_thread mocap-fusion
  expect "so is one whose fusion alone stands still" within_s 15 restarted 2
  expect "all is well once more" within_s 10 status_is "$alive_with_all_cameras"
  kill -KILL "$(show MainPID)"
  expect "a killed daemon is started anew" within_s 10 restarted 3
  expect "and has all cameras again" within_s 10 status_is "$alive_with_all_cameras"
}

check_stop() {
  local before_ms after_ms
  before_ms=$(date +%s%3N)
  systemctl stop mocapd
  after_ms=$(date +%s%3N)
  expect "stopped within a second: $((after_ms - before_ms)) ms" [ $((after_ms - before_ms)) -lt 1000 ]
  expect "and well" [ "$(systemctl is-failed mocapd)" = inactive ]
  expect "with its last words" journal_has info..info 'mocapd: ended, sets='
}

check_bad_settings() {
  echo 'treshold = 1' >>/etc/mocapd/mocapd.toml
  systemctl reset-failed mocapd 2>/dev/null || true
  systemctl start mocapd 2>/dev/null || true
  expect "a wrong configuration ends with 78" [ "$(show ExecMainStatus)" = 78 ]
  expect "and is not tried again: $(show ActiveState), $(show NRestarts) restarts" [ "$(show ActiveState)" = failed ]
  expect "the fault is an error with its place" journal_has err..err "mocapd.toml:[0-9]+:1: .*unknown key 'treshold'"
}

if [ "${1:-}" = --inside ]; then
  exec >/result/log 2>&1
  check_start
  check_real_time
  check_failures
  check_stop
  check_bad_settings
  [ $failures -eq 0 ] || journalctl --unit mocapd --output short-precise --no-pager
  echo "$failures" >/result/failures
  exit 0
fi

# --- outside: the container -------------------------------------------------------------------------------------------

[ "$(id -u)" -eq 0 ] || skip "needs root"
command -v systemd-nspawn >/dev/null || skip "systemd-nspawn is missing; apt-get install systemd-container"
[ -x /lib/systemd/systemd ] || skip "systemd is missing; apt-get install systemd"
if [ "${1:-}" != --in-own-mounts ]; then
  unshare --mount true 2>/dev/null || skip "the system allows no mount namespace"
  exec unshare --mount "$(realpath "$0")" --in-own-mounts "$(realpath "$1")"
fi
bin=$2
source=$(realpath "$(dirname "$0")/../..")
groups_before=$(ls -d /sys/fs/cgroup/*/{payload,supervisor} /sys/fs/cgroup/{payload,supervisor} 2>/dev/null || true)
work=$(mktemp -d)
finish() {
  umount -R "$work" 2>/dev/null || true
  rmdir "$work" 2>/dev/null || true
  # nspawn leaves its empty groups behind.
  for group in /sys/fs/cgroup/*/{payload,supervisor} /sys/fs/cgroup/{payload,supervisor}; do
    grep -qxF "$group" <<<"$groups_before" || find "$group" -depth -type d -exec rmdir {} + 2>/dev/null || true
  done
}
trap finish EXIT

mount -t tmpfs tmpfs "$work"
mkdir "$work"/{top,below,root,result}
mount -t overlay overlay -o "lowerdir=/,upperdir=$work/top,workdir=$work/below" "$work/root" 2>/dev/null ||
  skip "the system allows no overlay of /"
root=$work/root

# As the README says, with nothing else of this machine's services.
rm -rf "$root"/etc/systemd/system/* "$root"/etc/mocapd
: >"$root/etc/fstab"
mkdir -p "$root"/etc/mocapd
cp "$bin"/mocapd "$bin"/mocap-watch "$root"/usr/bin/
cp -r "$source"/config/{demo.rig.toml,markersets,skeletons} "$root"/etc/mocapd/
cp "$source"/systemd/mocapd.service "$root"/etc/systemd/system/
cp "$0" "$root"/usr/bin/mocapd-service-test
# A dump would go to this machine's own collector.
mkdir "$root"/etc/systemd/system/mocapd.service.d
printf '[Service]\nLimitCORE=0\n' >"$root"/etc/systemd/system/mocapd.service.d/no-dump.conf
{
  printf '[capture]\nrig = "demo.rig.toml"\n'
  printf '[[subject]]\nname = "actor"\nmarker_set = "markersets/openmocap18.toml"\n'
  for camera in cam1 cam2 cam3 cam4; do
    printf '[[camera]]\nname = "%s"\ndriver = "synthetic"\nrate_hz = 20\nmarker_set = "markersets/openmocap18.toml"\n' $camera
  done
  printf '[realtime]\nlock_memory = true\ncamera_fifo_priority = 40\nfusion_fifo_priority = 50\npublish_fifo_priority = 45\n'
} >"$root"/etc/mocapd/mocapd.toml
cat >"$root"/etc/systemd/system/test.service <<'END'
[Unit]
After=basic.target
Requires=basic.target
SuccessAction=poweroff-force
FailureAction=poweroff-force
[Service]
Type=oneshot
TimeoutStartSec=100
ExecStart=/usr/bin/mocapd-service-test --inside
END

SYSTEMD_NSPAWN_UNIFIED_HIERARCHY=1 timeout --signal=TERM --kill-after=5 110 systemd-nspawn --quiet --directory="$root" \
  --machine="mocapd-test-$$" --register=no --keep-unit --boot --private-network --link-journal=no --console=pipe \
  --capability=CAP_IPC_LOCK,CAP_SYS_NICE --bind="$work/result:/result" systemd.unit=test.service \
  </dev/null >"$work/console" 2>&1 || true

if [ ! -e "$work/result/log" ]; then
  tail -n 5 "$work/console"
  skip "no container can be booted here"
fi
cat "$work/result/log"
[ "$(cat "$work/result/failures" 2>/dev/null || echo unfinished)" = 0 ]
