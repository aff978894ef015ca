# shellcheck shell=bash
# Functions of the tests that boot a real systemd in a container over this machine's files, which are not changed. A test
# sources this file, and is a program with two parts: outside it makes the root of the container, inside it checks.

skip() {
  echo "$(basename "$0" .sh): skipped: $*"
  exit 77
}

# --- inside the container ---------------------------------------------------------------------------------------------

failures=0
expect() {  # WHAT COMMAND...: expects that the command succeeds
  local what=$1
  shift
  if "$@"; then echo "ok   $what"; else
    echo "FAIL $what"
    failures=$((failures + 1))
  fi
}
not() { ! "$@"; }
matches() { [[ "$1" =~ $2 ]]; }
matches_now() { matches "$("${@:2}")" "$1"; }  # REGEX COMMAND...
within_s() {  # SECONDS COMMAND...: repeats the command until it succeeds, at most this time
  local until=$((SECONDS + $1))
  shift
  until "$@"; do
    [ $SECONDS -lt "$until" ] || return 1
    sleep 0.1
  done
}
show() { systemctl show mocapd --property="$1" --value; }

# Shows the journal of the service unless all checks succeeded, and passes the number of failures on.
conclude() {
  if [ "$1" != 0 ]; then
    systemctl status --no-pager mocapd || true
    journalctl --unit mocapd --output short-precise --no-pager
  fi
  echo "$1" >/result/failures
}

# Runs these checks with their output in the result.
run_checks() {
  exec >/result/log 2>&1
  trap 'conclude unfinished' EXIT
  for check in "$@"; do "$check"; done
  trap - EXIT
  conclude $failures
  exit 0
}

# --- outside the container --------------------------------------------------------------------------------------------

# Runs the test again with mounts of its own, as root; skips it where that is not possible.
in_own_mounts() {
  [ -z "${MOCAP_OWN_MOUNTS:-}" ] || return 0
  [ "$(id -u)" -eq 0 ] || skip "needs root"
  command -v systemd-nspawn >/dev/null || skip "systemd-nspawn is missing; apt-get install systemd-container"
  [ -x /lib/systemd/systemd ] || skip "systemd is missing; apt-get install systemd"
  unshare --mount true 2>/dev/null || skip "the system allows no mount namespace"
  MOCAP_OWN_MOUNTS=1 exec unshare --mount "$(realpath "$0")" "$@"
}

# nspawn does not remove its empty control groups.
control_groups() { ls -d /sys/fs/cgroup/*/{payload,supervisor} /sys/fs/cgroup/{payload,supervisor} 2>/dev/null || true; }
remove_container() {
  umount -R "$work" 2>/dev/null || true
  rmdir "$work" 2>/dev/null || true
  control_groups | while read -r group; do
    grep -qxF "$group" <<<"$groups_before" || find "$group" -depth -type d -exec rmdir {} + 2>/dev/null || true
  done
}

# Makes $work, a folder in memory, and $root in it, an overlay of this machine's files without units of its own.
make_root() {
  groups_before=$(control_groups)
  work=$(mktemp -d)
  trap remove_container EXIT
  mount -t tmpfs tmpfs "$work"
  mkdir "$work"/{top,below,root,result}
  root=$work/root
  mount -t overlay overlay -o "lowerdir=/,upperdir=$work/top,workdir=$work/below" "$root" 2>/dev/null ||
    skip "the system allows no overlay of /"
  rm -rf "$root"/etc/systemd/system/* "$root"/etc/mocapd "$root"/usr/sbin/policy-rc.d
  : >"$root"/etc/fstab
  mkdir -p "$root"/usr/lib/mocap-test
  cp "$(realpath "$0")" "$root"/usr/lib/mocap-test/test.sh
  cp "$(dirname "$(realpath "$0")")"/container.sh "$root"/usr/lib/mocap-test/
}

# Boots the container with the part of the test inside, prints its result, and returns whether all checks succeeded.
boot_and_check() {  # SECONDS [OPTION...]: limit of the checks, options of systemd-nspawn
  cat >"$root"/etc/systemd/system/test.service <<END
[Unit]
After=basic.target
Requires=basic.target
SuccessAction=poweroff-force
FailureAction=poweroff-force
[Service]
Type=oneshot
TimeoutStartSec=$1
ExecStart=/usr/lib/mocap-test/test.sh --inside
END
  SYSTEMD_NSPAWN_UNIFIED_HIERARCHY=1 timeout --signal=TERM --kill-after=5 $(($1 + 10)) systemd-nspawn --quiet --directory="$root" \
    --machine="mocapd-test-$$" --register=no --keep-unit --boot --private-network --link-journal=no --console=pipe \
    --capability=CAP_IPC_LOCK,CAP_SYS_NICE --bind="$work/result:/result" "${@:2}" systemd.unit=test.service \
    </dev/null >"$work/console" 2>&1 || true
  if [ ! -e "$work/result/log" ]; then
    tail -n 5 "$work/console"
    skip "no container can be booted here"
  fi
  cat "$work/result/log"
  [ "$(cat "$work/result/failures" 2>/dev/null || echo unfinished)" = 0 ]
}
