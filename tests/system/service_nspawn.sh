#!/usr/bin/env bash
# Tests the service with a real systemd, booted in a container over this machine's files, which are not changed: ready
# notification, status, real time and locked memory or a clear warning, watchdog, restart, stop, no restart after a fault
# that a restart does not cure, keys, reload, and that the daemon writes to its state folder alone. Uses synthetic cameras.
# Skipped (77) if the container is not possible.
#
#   service_nspawn.sh BIN_DIR
set -euo pipefail

# shellcheck source=tests/system/container.sh
source "$(dirname "$(realpath "$0")")/container.sh"

# --- inside the container ---------------------------------------------------------------------------------------------

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
  expect "ready before the first images" status_is 'waiting|cameras='
  expect "the status has cameras and rates" within_s 10 status_is "$alive_with_all_cameras"
  echo "     $(show StatusText)"
  expect "the feed arrives" mocap-watch --seconds 10 --frames 10 --summary /dev/null
  expect "the journal has the start as information" journal_has info..info 'mocapd: started, cameras=4'
  expect "the service has its own user" matches "$(stat -c %U /proc/"$(show MainPID)")" '^(mocapd|[0-9]+)$'
}

check_real_time() {
  if [[ "$(show LimitRTPRIO)" -gt 0 ]] && [ "$(ulimit -Hr)" != 0 ]; then
    expect "SCHED_FIFO by the unit's limits" matches "$(policies)" 'SCHED_FIFO'
    expect "locked memory by the unit's limits" [ "$(locked_kb)" -gt 10000 ]
  else
    echo "note this machine does not raise the limits: testing the warnings instead"
    expect "denied priority is a warning with a remedy" journal_has warning..warning 'fusion: SCHED_FIFO.*LimitRTPRIO'
    expect "denied memory is a warning with a remedy" journal_has warning..warning 'memory.*LimitMEMLOCK=infinity'
  fi
  # Capabilities replace the limits; no other setting of the unit may prevent real time and locked memory.
  mkdir -p /run/systemd/system/mocapd.service.d
  printf '[Service]\n%s=CAP_NET_RAW CAP_SYS_NICE CAP_IPC_LOCK\n%s=CAP_NET_RAW CAP_SYS_NICE CAP_IPC_LOCK\n' \
    CapabilityBoundingSet AmbientCapabilities >/run/systemd/system/mocapd.service.d/allow.conf
  systemctl daemon-reload
  systemctl restart mocapd
  expect "SCHED_FIFO with the unit's sandbox" within_s 5 fifo_threads 6
  expect "locked memory with the unit's sandbox" [ "$(locked_kb)" -gt 10000 ]
}

# Stops one thread of the daemon with ptrace until the daemon ends.
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
  expect "all cameras run before the fault" within_s 10 status_is "$alive_with_all_cameras"
  local before=$SECONDS
  kill -STOP "$(show MainPID)"
  expect "a stopped daemon is killed and restarted" within_s 15 restarted 1
  expect "by the watchdog" journal_has warning 'Watchdog timeout|result .watchdog.'
  expect "not before the watchdog's timeout" [ $((SECONDS - before)) -ge 3 ]
  expect "all cameras run again" within_s 10 status_is "$alive_with_all_cameras"
  hold_thread mocap-fusion
  expect "a daemon whose fusion thread alone is stopped is restarted" within_s 15 restarted 2
  expect "all cameras run once more" within_s 10 status_is "$alive_with_all_cameras"
  kill -KILL "$(show MainPID)"
  expect "a killed daemon is restarted" within_s 10 restarted 3
  expect "and all cameras run again" within_s 10 status_is "$alive_with_all_cameras"
}

session() { mocapctl status --json 2>/dev/null | grep -o '"sessionId": *"[^"]*"'; }
version() { mocapctl description --json "$@" 2>/dev/null | grep -o '"version": *[0-9]*'; }
another_version() { local now; now=$(version "${@:2}") && [ -n "$now" ] && [ "$now" != "$1" ]; }
etc_files() { (cd /etc/mocapd && find . -type f -exec md5sum {} + | sort); }
subjects() { mocapctl status | awk '$1 == "subject" {printf "%s ", $2}'; }
subjects_are() { [ "$(subjects)" = "$1" ]; }
tracked() { mocapctl status "$@" | grep -q 'subject actor .* tracking'; }

check_reload() {
  local before described good
  before=$(session)
  described=$(version)
  good=$(cat /etc/mocapd/mocapd.toml)
  echo 'treshold = 1' >>/etc/mocapd/mocapd.toml
  systemctl reload mocapd
  expect "a reload with a fault is an error in the journal" within_s 10 journal_has err..err "reload: .*unknown key 'treshold'"
  expect "and the daemon keeps its settings" [ "$(session)" = "$before" ]
  printf '%s\n' "$good" >/etc/mocapd/mocapd.toml
  systemctl reload mocapd
  expect "a reload without faults changes the configuration" within_s 10 another_version "$described"
  expect "in the same session" [ "$(session)" = "$before" ]
  expect "in the same process" restarted 3
}

check_written_files() {
  local before etc
  etc=$(etc_files)
  expect "the actor is tracked" within_s 20 tracked
  before=$(version)
  expect "a mask is learnt" mocapctl mask learn --images 60 --timeout-s 50
  expect "and used" within_s 10 another_version "$before"
  expect "a subject is added" mocapctl subject add wand --marker-set /etc/mocapd/markersets/rigid4.toml
  expect "and used" within_s 10 subjects_are "actor wand "
  expect "the fit of the actor is kept" within_s 20 [ -s /var/lib/mocapd/bodies/actor.toml ]
  kill -KILL "$(show MainPID)"
  expect "a killed daemon is restarted with all of it" within_s 10 restarted 4
  expect "with both subjects" within_s 10 matches_now 'actor wand' subjects
  expect "with the kept fit" within_s 10 tracked
  mocapctl config show >/tmp/shown
  expect "the added subject has its source" grep -q 'subject.wand.name = "wand"  # /var/lib/mocapd/added_subjects.toml:' /tmp/shown
  expect "the learnt masks have their source" grep -q 'mask_learnt = [0-9].*# /var/lib/mocapd/learnt_masks.toml:' /tmp/shown
  expect "the kept fit has its source" grep -q 'subject.actor.body = fitted  # /var/lib/mocapd/bodies/actor.toml' /tmp/shown
  expect "a recording is in the state folder" [ -s /var/lib/mocapd/takes/all.jsonl ]
  expect "nothing in /etc/mocapd has changed" [ "$(etc_files)" = "$etc" ]
}

check_keys() {
  local keys=(--server-key /etc/mocapd/server.key --secret-key /root/anna.key)
  mocapctl keys new /etc/mocapd/server.key >/dev/null
  mocapctl keys new /root/anna.key >/dev/null
  mocapctl keys allow /root/anna.key --name anna --role operator --list /etc/mocapd/allowed.keys >/dev/null
  # shellcheck disable=SC2016  # the daemon expands the variable
  printf '[security]\nserver_key = "$CREDENTIALS_DIRECTORY/server.key"\nallowed_keys = "allowed.keys"\n' >>/etc/mocapd/mocapd.toml
  expect "the file is good outside the service, too" mocapd --check-config /etc/mocapd/mocapd.toml --state /var/lib/mocapd
  # As the comment in the unit says.
  mkdir -p /etc/systemd/system/mocapd.service.d
  { echo '[Service]'; sed -n 's/^#LoadCredential=/LoadCredential=/p' /etc/systemd/system/mocapd.service; } \
    >/etc/systemd/system/mocapd.service.d/key.conf
  systemctl daemon-reload
  systemctl restart mocapd
  expect "the service has its key as a credential" within_s 10 version "${keys[@]}"
  expect "a client without a key has no answer" not mocapctl status --timeout-s 1
  local before
  before=$(version "${keys[@]}")
  systemctl reload mocapd
  expect "the key is there after a reload" within_s 10 another_version "$before" "${keys[@]}"
  mocapctl keys revoke anna --list /etc/mocapd/allowed.keys >/dev/null
  expect "a revoked key is refused without a restart" within_s 10 not mocapctl status --timeout-s 1 "${keys[@]}"
  mocapctl keys allow /root/anna.key --name anna --list /etc/mocapd/allowed.keys >/dev/null

  # shellcheck disable=SC2016  # the daemon expands the variable
  sed -i 's#\$CREDENTIALS_DIRECTORY/##' /etc/mocapd/mocapd.toml
  chmod 644 /etc/mocapd/server.key
  systemctl restart mocapd || true
  expect "a key that others can read is refused" [ "$(show ExecMainStatus)" = 78 ]
  expect "with the command that cures it" journal_has err..err "mode 0644.*chmod 600 '/etc/mocapd/server.key'"
  chmod 600 /etc/mocapd/server.key
  # shellcheck disable=SC2016  # the daemon expands the variable
  sed -i 's#server_key = "#&$CREDENTIALS_DIRECTORY/#' /etc/mocapd/mocapd.toml
  systemctl start mocapd
  expect "and the service runs again" within_s 10 version "${keys[@]}"
}

check_stop() {
  local before_ms after_ms
  before_ms=$(date +%s%3N)
  systemctl stop mocapd
  after_ms=$(date +%s%3N)
  expect "stopped within a second: $((after_ms - before_ms)) ms" [ $((after_ms - before_ms)) -lt 1000 ]
  expect "without failure" [ "$(systemctl is-failed mocapd)" = inactive ]
  expect "with a summary in the journal" journal_has info..info 'mocapd: ended, sets='
}

check_bad_settings() {
  echo 'treshold = 1' >>/etc/mocapd/mocapd.toml
  systemctl reset-failed mocapd 2>/dev/null || true
  systemctl start mocapd 2>/dev/null || true
  expect "a wrong configuration ends with 78" [ "$(show ExecMainStatus)" = 78 ]
  expect "and is not restarted: $(show ActiveState), $(show NRestarts) restarts" [ "$(show ActiveState)" = failed ]
  expect "the fault is an error with its place" journal_has err..err "mocapd.toml:[0-9]+:1: .*unknown key 'treshold'"
}

[ "${1:-}" != --inside ] || run_checks check_start check_real_time check_failures check_reload check_written_files check_keys \
  check_stop check_bad_settings

# --- outside the container --------------------------------------------------------------------------------------------

in_own_mounts "$@"
bin=$(realpath "$1")
source=$(realpath "$(dirname "$0")/../..")
make_root

# Installs the service as the README describes.
mkdir -p "$root"/etc/mocapd
cp "$bin"/{mocapd,mocapctl,mocap-watch} "$root"/usr/bin/
cp -r "$source"/config/{demo.rig.toml,markersets,skeletons} "$root"/etc/mocapd/
cp "$source"/systemd/mocapd.service "$root"/etc/systemd/system/
# Disables core dumps, which would go to this machine's collector.
mkdir "$root"/etc/systemd/system/mocapd.service.d
printf '[Service]\nLimitCORE=0\n' >"$root"/etc/systemd/system/mocapd.service.d/no-dump.conf
{
  printf '[capture]\nrig = "demo.rig.toml"\n'
  printf '[record]\nsnapshots = "takes/all.jsonl"\n'
  printf '[[subject]]\nname = "actor"\nmarker_set = "markersets/openmocap18.toml"\nkeep = "bodies/actor.toml"\n'
  for camera in cam1 cam2 cam3 cam4; do
    printf '[[camera]]\nname = "%s"\ndriver = "synthetic"\nrate_hz = 20\nmarker_set = "markersets/openmocap18.toml"\n' $camera
  done
  printf '[realtime]\nlock_memory = true\ncamera_fifo_priority = 40\nfusion_fifo_priority = 50\npublish_fifo_priority = 45\n'
} >"$root"/etc/mocapd/mocapd.toml
boot_and_check 280
