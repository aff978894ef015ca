#!/usr/bin/env bash
# Plays the first hour of three people in a booted container over this machine's files, which are not changed: an operator with
# (simulated) GigE cameras, the author of a plug-in, and an administrator. They have a clone in a folder with a space in its path,
# are not root, and run the commands of README.md as printed (readme.py): a command that no role runs is a failure. Prints a
# table of the steps, their times and results, and the times from the clone to the first skeleton, to a client's first frame and
# to the packaged service. Skipped (77) if the container is not possible.
#
#   first_hour.sh     the clone compiles what ccache does not have of this build
set -euo pipefail

# shellcheck source=tests/system/container.sh
source "$(dirname "$(realpath "$0")")/container.sh"

# --- inside the container ---------------------------------------------------------------------------------------------

clone="/home/studio/motion capture/mocapd"
exports=/usr/lib/mocap-test/exports.sh  # what the user's shell knows
log=/tmp/step.log
table=/tmp/table
declare -A played
failed=0

as_user() {  # COMMAND: as the user types it into a shell in the clone
  cd "$clone" 2>/dev/null || cd /home/studio
  timeout 600 setpriv --reuid=studio --regid=studio --init-groups --reset-env env BASH_ENV=$exports bash -c "$1" </dev/null
}

# Adds a step to the table. After a failure, shows the end of its output.
row() {  # STEP BEGAN CODE: BEGAN in ms
  local result=ok
  if [ "$3" != 0 ]; then
    result=FAILED
    failed=$((failed + 1))
    echo "FAIL $1: exit code $3; the end of its output:"
    tail -n 30 "$log"
  fi
  printf '%-8s  %6.1f s  %-6s  %s\n' "$role" "$((now - $2))e-3" "$result" "$1" >>$table
}

# Runs a step of the test's own and adds it to the table.
step() {  # STEP COMMAND...
  local began code=0
  began=$(date +%s%3N)
  "${@:2}" >$log 2>&1 || code=$?
  now=$(date +%s%3N)
  row "$1" "$began" $code
}

# Sets $command to the README's command that begins so.
find_printed() {  # BEGINNING
  for command in "${printed[@]}"; do
    [[ $command != "$1"* ]] || { played[$command]=1; return; }
  done
  step "a command '$1...' in the README" false
  return 1
}

# Runs the README's command that begins so, with more words if the test needs them, as the user. A failure with the exit code
# $but is accepted.
play() {  # BEGINNING [WORD...]
  local command
  find_printed "$1" || return 0
  step "$command${2:+ ${*:2}}" run_but "${but:-0}" "$command ${*:2}"
  [[ $command != export* ]] || echo "cd '$clone' && $command" >>$exports
}
run_but() {  # CODE COMMAND
  local code=0
  as_user "$2" || code=$?
  [ $code = "$1" ] || return $code
}

# Runs the README's command that begins so until stop, and waits until READY succeeds.
start() {  # BEGINNING READY...
  local command
  find_printed "$1" || return 0
  as_user "echo \$\$ >~/running; exec ${command%&}" >/tmp/daemon.log 2>&1 &
  step "$command" within_s 60 "${@:2}" || true
  [ "$(tail -n 1 $table | grep -c FAILED)" = 0 ] || tail -n 30 /tmp/daemon.log
}
stop() {
  kill -TERM "$(cat /home/studio/running)" 2>/dev/null || true
  within_s 20 not tracked || true
}

# Runs the README's mocap-web until the page says that the daemon's feed arrives.
show_page() {
  local command
  find_printed mocap-web || return 0
  as_user "exec $command" >/tmp/page.log 2>&1 &
  step "$command" within_s 60 page_is_ready || true
  pkill -TERM -x mocap-web || true
}
page_is_ready() { python3 -c 'import urllib.request as web; web.urlopen("http://127.0.0.1:5580/readyz", timeout=5)' 2>/dev/null; }

# A command of the README that cannot run here, or is no step.
excuse() {  # COMMAND WHY
  find_printed "$1" || return 0
  printf '%-8s  %8s  %-6s  %s\n' - - "- " "$command: $2" >>$table
}

# Notes the time since the clone.
reached() { summary+="$(printf '%-32s %6.1f s' "$1" "$(($(date +%s%3N) - cloned_at))e-3")"$'\n'; }

tracked() { as_user 'mocapctl status' 2>/dev/null | grep -q 'subject actor .* tracking'; }
feed_arrives() { as_user 'mocap-watch --seconds 20 --frames 10 --summary /dev/null'; }

# Switches the four simulated cameras on; they see what `mocap-sim ARGUMENTS` describes.
cameras() {  # ARGUMENTS...
  stop_cameras
  "$clone/build/release/bin/mocap-sim" --serve --rig "$clone/config/demo.rig.toml" --serial-prefix DA1234 "$@" >/tmp/cameras.log 2>&1 &
  simulator=$!
  within_s 20 four_cameras || true
}
four_cameras() { [ "$("$clone/build/release/bin/mocapctl" cameras list 2>/dev/null | grep -c DA1234)" = 4 ]; }
stop_cameras() {
  [ -z "${simulator:-}" ] || kill -TERM "$simulator" 2>/dev/null || true
  wait "${simulator:-}" 2>/dev/null || true
}

# The README's my.toml with the names and serial numbers of the four cameras. Their network is the loopback interface,
# where a packet socket receives nothing.
my_toml() {
  local shown
  shown=$(readme block toml)
  sed '/^\[\[camera\]\]/,$d' <<<"$shown"
  for number in 1 2 3 4; do
    sed -n '/^\[\[camera\]\]/,$p' <<<"$shown" | sed "s/\"north-east\"/\"cam$number\"/; s/\"DA1234567\"/\"DA123400$number\"/"
    printf 'packet_socket = false\npacket_size_bytes = 8000\n\n'
  done
}
write_my_toml() { my_toml >"$clone/my.toml" && chown studio: "$clone/my.toml"; }
readme() { as_user "tests/system/readme.py $* README.md"; }

clone_it() {
  cloned_at=$(date +%s%3N)
  role="operator"
  step "git clone" as_user "mkdir -p '${clone%/*}' && git clone -q /srv/mocapd.git '$clone'"
  mapfile -t printed < <(readme commands)
}

play_operator() {
  role="operator"
  play tools/demo.sh
  reached "from clone to skeleton"
  play tools/build.sh
  play 'export PATH='
  cameras --motion wand:0,160,500
  play 'mocapctl cameras list'
  but=69 play 'mocapctl doctor'  # a finding is bad: the container has the kernel settings of this machine
  step "my.toml" write_my_toml
  play 'mocap-calibrate wand' --seconds 20
  cameras --motion frame:600,400
  play 'mocap-calibrate floor'
  play 'mocap-calibrate import' --help
  cameras --empty
  play 'mocap-calibrate mask'
  play 'mocapd --check-config'
  cameras --motion tpose:5,walk
  start 'mocapd --config my.toml' tracked
  play 'mocap-watch --doctor'
  play 'mocapctl status'
  show_page
  but=69 play 'mocapctl preflight'  # it names what this room lacks, as a calibration by hand
  play 'mocapctl take start'
  play 'mocapctl take stop'
  play 'mocapctl take list'
  play 'mocapctl take repair'
  play 'mocapctl take retrack takes/walk.mcap'
  step "a take takes/long.mcap" as_user 'cp takes/walk.mcap takes/long.mcap'
  play 'mocapctl take retrack takes/long.mcap'
  play 'mocap-watch takes/walk.mcap'
  play 'mocapctl take export'
  stop
  stop_cameras
}

play_author() {
  role="author"
  start 'build/release/bin/mocapd --config config/synthetic.toml' tracked
  play PYTHONPATH= '| head -n 1 | grep LeftHand'
  reached "from clone to a client's frame"
  stop
}

play_administrator() {
  role="admin"
  play tools/package.sh
  play 'sudo apt install'
  step "the actor of the synthetic cameras is tracked" within_s 60 tracked
  reached "from clone to packaged service"
  step "the feed of the service arrives" feed_arrives
  play 'sudo systemctl enable --now mocap-web'
  step "the page of the service has the feed" within_s 60 page_is_ready
  play 'man mocapctl-keys-new'
  play 'sudo mocapctl config show'
  play 'sudo systemctl reload mocapd'
  step "the actor is tracked after the reload" within_s 60 tracked
  play 'mocapctl keys' --help
  play 'sudo apt purge mocapd'
  play 'sudo cmake --install'
  play 'sudo mkdir /etc/mocapd'
  cameras --motion tpose:5,walk
  play 'sudo systemctl enable --now mocapd'
  step "the actor of the calibrated cameras is tracked" within_s 60 tracked
  play 'systemctl status' mocapd
  stop_cameras
}

check_first_hour() {
  for host in 2 3 4 5; do ip addr add 127.0.0.$host/8 dev lo; done
  clone_it
  play_operator
  play_author
  play_administrator
  excuse tools/test.sh "all tests, of which this is one"
  excuse 'mocapd --state' "an option, which the unit passes"
  local command
  for command in "${printed[@]}"; do
    [ -n "${played[$command]:-}" ] || step "no role plays '$command'" false
  done
  cat $table
  printf '%s' "$summary"
  echo "steps that failed: $failed"
  expect "the README is played without a failure" [ "$failed" = 0 ]
}
summary=

[ "${1:-}" != --inside ] || run_checks check_first_hour

# --- outside the container --------------------------------------------------------------------------------------------

in_own_mounts "$@"
command -v sudo >/dev/null || skip "sudo is missing; tools/setup.sh --tests"
command -v dpkg-buildpackage >/dev/null || skip "dpkg-buildpackage is missing; tools/setup.sh --tests"
source=$(realpath "$(dirname "$0")/../..")
trust() { git -c safe.directory='*' -C "$source" "$@"; }
trust rev-parse --quiet --verify HEAD >/dev/null || skip "the source is no clone of a git repository"
make_root

# The clone is of the files as they are, as far as git has them.
commit=$(trust -c user.name=studio -c user.email=studio@localhost stash create)
git init --quiet --bare --initial-branch=main "$root"/srv/mocapd.git
trust push --quiet "$root"/srv/mocapd.git "${commit:-HEAD}":refs/heads/main

chroot "$root" useradd --create-home --shell /bin/bash studio
chroot "$root" chown -R studio: /srv/mocapd.git
echo 'studio ALL=(ALL) NOPASSWD: ALL' >"$root"/etc/sudoers.d/studio
# The user answers apt with yes.
echo 'APT::Get::Assume-Yes "true";' >"$root"/etc/apt/apt.conf.d/90studio
# ccache distinguishes the languages of the compiler's messages.
cat >"$root"/usr/lib/mocap-test/exports.sh <<END
export PATH=/usr/local/bin:/usr/bin:/bin CCACHE_DIR=/ccache CCACHE_READONLY=1 CCACHE_TEMPDIR=/tmp/ccache
$(env | grep -E '^(LANG|LC_[A-Z]+)=' | sed 's/^/export /')
END
options=()
if cache=$(ccache --get-config cache_dir 2>/dev/null) && [ -d "$cache" ]; then options+=(--bind-ro="$cache:/ccache"); fi
boot_and_check 1500 "${options[@]}"
