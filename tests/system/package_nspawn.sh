#!/usr/bin/env bash
# Tests the Debian packages with apt in a booted container over this machine's files, which are not changed: installation ends
# with a running service, an upgrade keeps what the user edited and recorded, removal stops the service, purge keeps recordings.
# Also: man pages, completions in real shells, the C library, the Python client. Skipped (77) if the container is not possible.
#
#   package_nspawn.sh
set -euo pipefail

# shellcheck source=tests/system/container.sh
source "$(dirname "$(realpath "$0")")/container.sh"

# --- inside the container ---------------------------------------------------------------------------------------------

apt_log=/tmp/apt.log
apt() {  # ARGUMENTS: as a user calls it, without questions; the output goes to $apt_log and, after a failure, to the result
  DEBIAN_FRONTEND=noninteractive apt-get --yes "$@" </dev/null >$apt_log 2>&1 || { cat $apt_log; return 1; }
}
said() { grep -q -- "$1" $apt_log; }
tracked() { mocapctl status 2>/dev/null | grep -q 'subject actor .* tracking'; }
version() { dpkg-query --show --showformat='${Version}' mocapd; }
lines_of() { if [ -e "$1" ]; then wc -l <"$1"; else echo 0; fi; }
is_longer() { [ "$(lines_of "$1")" -gt "$2" ]; }
state=/var/lib/private/mocapd

# Whether the unit runs, and its log says so: a system call that the unit forbids would end the program at its start.
unit_says() {  # UNIT TEXT
  systemctl start "$1"
  within_s 60 journal_has "$1" "$2"
}
journal_has() { journalctl --unit "$1" --output cat | grep -q -- "$2"; }
page_is_ready() { python3 -c 'import urllib.request as web; web.urlopen("http://127.0.0.1:5580/readyz", timeout=5)' 2>/dev/null; }

check_install() {
  expect "apt installs the packages" apt install /packages/1/*.deb
  expect "one sentence says what to edit" said 'edit /etc/mocapd/mocapd.toml'
  expect "the first lines of that file say how" matches "$(head -n 12 /etc/mocapd/mocapd.toml)" 'mocapctl cameras list.*serial ='
  expect "the service runs" [ "$(show ActiveState)" = active ]
  expect "and starts at boot" systemctl --quiet is-enabled mocapd
  expect "the actor of the synthetic cameras is tracked" within_s 30 tracked
  expect "the feed arrives" mocap-watch --seconds 20 --frames 10 --summary /dev/null
  expect "the page is not started unasked" not systemctl --quiet is-active mocap-web
  expect "the unit of the page runs" unit_says mocap-web 'http://127.0.0.1:5580'
  expect "and has the feed" within_s 60 page_is_ready
  expect "the unit of a bridge runs and has the feed" unit_says mocap-bridge@natnet 'all is well'
  systemctl stop mocap-web mocap-bridge@natnet
  expect "sysctl and udev have the files of the cameras" ls /usr/lib/sysctl.d/60-mocapd.conf /lib/udev/rules.d/60-mocapd.rules
}

bash_proposes() {  # PATTERN COMMAND-LINE...: the last word of the line is empty
  bash -c 'source "/usr/share/bash-completion/completions/$2"
    COMP_WORDS=("${@:2}" "") COMP_CWORD=$(($# - 1))
    "_${2//-/_}"; printf "%s\n" "${COMPREPLY[@]}" | grep -qx -- "$1"' bash "$@"
}
fish_proposes() {  # WORD COMMAND-LINE
  fish --command "complete --do-complete '$2'" | cut -f 1 | grep -qx -- "$1"
}
zsh_proposes() {  # WORD COMMAND-LINE: types the line and two tabs into a shell in a terminal
  cat >/tmp/propose.zsh <<'END'
zmodload zsh/zpty
zpty shell zsh -f -i
zpty -w shell 'stty cols 200; LISTMAX=1000; autoload -Uz compinit; compinit -u -D; echo "ready"!'
zpty -r shell line $'*ready!\r*'
zpty -w -n shell "$2"$'\t\t'
for second in {1..20}; do
  sleep 1
  while zpty -r -t shell line; do text+=$line; done
  [[ $text == *"$1"* ]] && exit 0
done
print -r -- "$text"
exit 1
END
  zsh -f /tmp/propose.zsh "$@"
}

check_documents() {
  local program
  for program in /usr/bin/mocap*; do
    program=${program##*/}
    expect "$program has a man page" man --where "$program"
    expect "zsh reads the completion of $program" zsh -n "/usr/share/zsh/vendor-completions/_$program"
    expect "bash completes $program" bash_proposes '..*' "$program"
  done
  expect "a subcommand has a man page" man --where mocapctl-keys-new
  expect "bash completes a subcommand" bash_proposes new mocapctl keys
  expect "bash completes the choices of an option" bash_proposes operator mocapctl keys allow --role
  expect "fish completes a subcommand" fish_proposes new 'mocapctl keys '
  expect "fish completes the choices of an option" fish_proposes operator 'mocapctl keys allow --role '
  expect "fish completes an option" fish_proposes --check-config 'mocapd --'
  expect "zsh completes a subcommand" zsh_proposes revoke 'mocapctl keys '
}

c_client() {
  local flags
  read -ra flags <<<"$(pkg-config --cflags --libs mocap_client)"
  printf '#include <mocap_client.h>\nint main(void) { return mocap_client_abi() != MOCAP_CLIENT_ABI; }\n' >/tmp/client.c
  cc -o /tmp/client /tmp/client.c "${flags[@]}" && /tmp/client
}
python_client() {
  (cd /tmp && /usr/bin/python3 -c 'import mocap.v1.health_pb2, mocap_client
with mocap_client.Client("tcp://127.0.0.1:5570") as client: assert "actor" in client.wait(20.0).subjects')
}
check_clients() {
  expect "a C program builds with the library and runs" c_client
  expect "the Python client receives a frame" python_client
}

check_upgrade() {
  local before lines
  printf '\n[record]\nsnapshots = "takes/all.jsonl"\n' >>/etc/mocapd/mocapd.toml
  expect "the service reloads" systemctl reload mocapd
  expect "a recording begins" within_s 20 is_longer $state/takes/all.jsonl 2
  expect "a subject is added" mocapctl subject add wand --marker-set /usr/share/mocapd/markersets/rigid4.toml
  expect "and written" within_s 20 test -s $state/added_subjects.toml
  before=$(show MainPID)
  lines=$(lines_of $state/takes/all.jsonl)
  expect "apt installs a higher version" apt install /packages/2/*.deb
  expect "which is $(version)" matches "$(version)" '-2$'
  expect "it does not repeat the sentence for the first installation" not said 'edit /etc/mocapd/mocapd.toml'
  expect "the edited configuration is kept" grep -q 'takes/all.jsonl' /etc/mocapd/mocapd.toml
  expect "the service was restarted" [ "$(show MainPID)" != "$before" ]
  expect "and tracks the actor" within_s 30 tracked
  expect "the added subject is kept" matches "$(mocapctl status)" 'subject wand'
  expect "the recording of before is not shorter" not test "$(lines_of $state/takes/all.jsonl)" -lt "$lines"
}

check_remove() {
  expect "apt removes the packages" apt remove mocapd mocap-tools libmocap-client1 python3-mocap-client
  expect "the service has ended" not pgrep -x mocapd
  expect "its unit is gone" not systemctl cat mocapd
  expect "the configuration stays" test -s /etc/mocapd/mocapd.toml
  expect "the added subject stays" test -s $state/added_subjects.toml
}

check_purge() {
  expect "apt purges the packages" apt purge mocapd
  expect "the configuration is gone" not test -e /etc/mocapd
  expect "the daemon's own state is gone" not test -e $state/added_subjects.toml
  expect "the recording stays" test -s $state/takes/all.jsonl
  expect "and purge says where" said "stay in $state"
  rm -r $state/takes
  expect "apt installs the packages again" apt install /packages/2/*.deb
  expect "the service runs on the new configuration" within_s 30 tracked
  expect "apt purges the packages again" apt purge mocapd mocap-tools
  expect "without recordings nothing stays" not ls /var/lib/mocapd $state
}

[ "${1:-}" != --inside ] || run_checks check_install check_documents check_clients check_upgrade check_remove check_purge

# --- outside the container --------------------------------------------------------------------------------------------

# Writes the packages of the first folder into the second as revision 2, which is faster than to build them again.
upgrade_of() {
  local package version
  mkdir "$2"
  for package in "$1"/*.deb; do
    dpkg-deb --raw-extract "$package" "$work/unpacked"
    version=$(dpkg-deb --field "$package" Version)
    sed -i "s/$version/${version%-*}-2/" "$work/unpacked/DEBIAN/control"
    dpkg-deb -Znone --build "$work/unpacked" "$2" >/dev/null
    rm -r "$work/unpacked"
  done
}

in_own_mounts "$@"
command -v dpkg-buildpackage >/dev/null || skip "dpkg-buildpackage is missing; tools/setup.sh --packages"
make_root
source=$(realpath "$(dirname "$0")/../..")
"$source"/tools/package.sh --out "$root"/packages/1
/usr/bin/python3 "$source"/tests/system/sbom.py "$root"/packages/1
upgrade_of "$root"/packages/1 "$root"/packages/2
boot_and_check 900
