#!/usr/bin/env bash
# Runs a program with simulated cameras on its own kernel, in a virtual machine that needs neither KVM nor root. The root of
# the guest is the host's / (read-only over 9p, with a tmpfs overlay), so that built programs run unchanged from any folder but
# /run and below.
#
#   guest_vm.sh [vivid=N] [loopback=N] [usb3=N] [usbip=N] [sound=N] BUILD_DIR PROGRAM [ARGUMENT...]
#
#   vivid=N     N cameras /dev/video0.. of the kernel's test driver
#   loopback=N  N devices /dev/video0.. of v4l2loopback, which deliver the images that another program writes
#   usb3=N      N USB3 host controllers whose devices programs simulate (dummy_hcd, FunctionFS), and udev
#   usbip=N     N devices that programs simulate, all on one USB2 host controller (vhci_hcd.0); needs usb3
#   sound=N     N sound cards hw:0.. of snd-aloop: what a program plays on hw:N,0 is recorded from hw:N,1
#
# Exit code: that of PROGRAM; 77 with a reason if the virtual machine is not possible. Kernel, headers and other packages are
# downloaded once into BUILD_DIR/guest_vm.
set -euo pipefail

skip() {
  echo "guest_vm: skipped: $*"
  exit 77
}

vivid=0 loopback=0 usb3=0 usbip=0 sound=0
while :; do
  case "${1:-}" in
    vivid=*) vivid=${1#*=} ;;
    loopback=*) loopback=${1#*=} ;;
    usb3=*) usb3=${1#*=} ;;
    usbip=*) usbip=${1#*=} ;;
    sound=*) sound=${1#*=} ;;
    *) break ;;
  esac
  shift
done
build=$(realpath "$1")
program=$(realpath "$2")
shift 2
here=$(realpath "$(dirname "$0")")
cache=$build/guest_vm
mkdir -p "$cache"
exec 9>"$cache/lock"
flock 9

command -v qemu-system-x86_64 >/dev/null || skip "qemu-system-x86_64 is missing; apt-get install qemu-system-x86"
busybox=$(command -v busybox) || skip "busybox is missing; apt-get install busybox-static"
{ ldd "$busybox" 2>&1 || true; } | grep -qE 'not a dynamic|statically linked' || skip "busybox is not static; apt-get install busybox-static"
command -v cpio >/dev/null || packer="$busybox cpio"

# The packages are unpacked in $unpacking: the build of a kernel module refuses a path with spaces, as $cache may have.
unpacking=$(mktemp -d /tmp/mocap-guest.XXXXXX)
trap 'rm -rf "$unpacking"' EXIT

# Downloads Debian packages and unpacks them into $unpacking; installs nothing. Does nothing if $cache/NAME exists.
fetch() {
  local name=$1
  shift
  [ -d "$cache/$name" ] && return
  for package in "$@"; do
    (cd "$unpacking" && apt-get download -qq "$package" >/dev/null 2>&1) || skip "cannot download $package"
    dpkg -x "$unpacking/$package"_*.deb "$unpacking/$name"
    rm -f "$unpacking/$package"_*.deb
  done
}
# Moves the unpacked packages NAME into the cache, as a whole or not at all.
keep() {
  rm -rf "$cache/$1.new"
  cp -r "$unpacking/$1" "$cache/$1.new"
  mv "$cache/$1.new" "$cache/$1"
}

if [ ! -d "$cache/root" ]; then
  package=$(apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/.*Depends: \(linux-image-[0-9][^ ]*-amd64\).*/\1/p' | head -1)
  [ -n "$package" ] || skip "apt knows no linux-image-amd64"
  fetch root "$package"
  release=$(ls "$unpacking/root/lib/modules")
  "$busybox" depmod -b "$unpacking/root" "$release" 2>/dev/null || true
  [ -s "$unpacking/root/lib/modules/$release/modules.dep" ] || skip "cannot index the modules of $package"
  keep root
fi
kernels=("$cache"/root/boot/vmlinuz-*)
kernel=${kernels[0]}
release=${kernel##*/vmlinuz-}
modules=$cache/root/lib/modules/$release

if [ "$loopback" -gt 0 ] && [ ! -d "$cache/loopback" ]; then
  fetch loopback v4l2loopback-dkms "linux-headers-$release" "linux-headers-${release%-*}-common" "linux-kbuild-$(cut -d. -f1,2 <<<"$release")"
  sources=$unpacking/loopback/usr/src
  headers=$sources/linux-headers-$release
  sed -i "s#/usr/src#$sources#g" "$headers/Makefile"
  mkdir "$unpacking/built"
  cp "$sources"/v4l2loopback-*/*.[ch] "$unpacking/built/"
  echo 'obj-m := v4l2loopback.o' >"$unpacking/built/Makefile"
  make -s -C "$headers" M="$unpacking/built" modules >"$cache/loopback.log" 2>&1 || skip "v4l2loopback cannot be built, see $cache/loopback.log"
  rm -rf "$unpacking/loopback"
  mkdir "$unpacking/loopback"
  mv "$unpacking/built/v4l2loopback.ko" "$unpacking/loopback/"
  keep loopback
fi
# libusb learns of connected devices only from udev.
if [ "$usb3" -gt 0 ] && [ ! -d "$cache/udev" ]; then
  fetch udev udev
  keep udev
fi

# Prints modules as paths below $modules, each after all its dependencies.
in_order() {
  local line
  for module in "$@"; do
    line=$(grep -E "(^|/)$module\.ko:" "$modules/modules.dep") || skip "the kernel has no module $module"
    for path in $(echo "${line#*:}" | tr ' ' '\n' | tac) ${line%%:*}; do echo "$path"; done
  done | awk '!seen[$0]++'
}
# Prints WORD COUNT times, separated by commas.
each() {
  local list=
  for ((i = 0; i < $2; i++)); do list+=${list:+,}$1; done
  echo "$list"
}
wanted=()
[ "$vivid" -eq 0 ] || wanted+=(vivid)
[ "$loopback" -eq 0 ] || wanted+=(videodev)
[ "$usb3" -eq 0 ] || wanted+=(dummy_hcd usb_f_fs)
[ "$usbip" -eq 0 ] || wanted+=(vhci-hcd usbip-vudc)
[ "$sound" -eq 0 ] || wanted+=(snd-aloop)
vivid_options="n_devs=$vivid node_types=$(each 0x1 "$vivid") no_error_inj=0"
# Prints the words quoted for a shell.
quoted() {
  local words
  words=$(printf '%q ' "$@")
  echo "${words% }"
}
vivid_module=$(in_order vivid | tail -1)
insert_vivid="$busybox insmod $(quoted "$modules/$vivid_module") $vivid_options"

image=$cache/initramfs.$$
trap 'rm -rf "$image" "$image".cpio "$cache/output.$$" "$unpacking"' EXIT
mkdir -p "$image"/{bin,modules,proc,sys,dev,lower,upper,root}
cp "$busybox" "$image/bin/busybox"
for path in $(in_order virtio_pci 9p 9pnet_virtio overlay); do
  cp "$modules/$path" "$image/modules/"
  echo "insmod /modules/$(basename "$path")" >>"$image/load"
done
for path in $(in_order "${wanted[@]}"); do
  case $path in
    */vivid.ko) options=$vivid_options ;;
    */dummy_hcd.ko) options="is_super_speed=1 num=$usb3" ;;
    */usbip-vudc.ko) options="num=$usbip" ;;
    */snd-aloop.ko) options="enable=$(each 1 "$sound")" ;;
    *) options= ;;
  esac
  echo "insmod $(quoted "/root$modules/$path") $options"
done >"$image/insert"
[ "$loopback" -eq 0 ] || echo "insmod $(quoted "/root$cache/loopback/v4l2loopback.ko") devices=$loopback exclusive_caps=$(each 1 "$loopback")" >>"$image/insert"
cat >"$image/init" <<END
#!/bin/busybox sh
export PATH=/bin
/bin/busybox --install -s /bin
mount -t proc proc /proc; mount -t sysfs sysfs /sys; mount -t devtmpfs dev /dev
. /load
mount -t 9p -o trans=virtio,version=9p2000.L,ro,msize=262144,cache=loose root9p /lower
mount -t tmpfs tmpfs /upper
mkdir /upper/top /upper/work
mount -t overlay -o lowerdir=/lower,upperdir=/upper/top,workdir=/upper/work overlay /root
mount -t tmpfs tmpfs /root/run
. /insert
echo never >/sys/kernel/mm/transparent_hugepage/enabled # so that the memory of a process is only what it uses
[ "$usb3" = 0 ] || mount -t configfs configfs /sys/kernel/config
mkdir -p /dev/shm
for each in proc sys dev; do mount -o rbind /\$each /root/\$each; done
ip link set lo up
mkdir /root/run/desk
cat >/root/run/program <<'RUN'
cd /run/desk
export HOME=/run/desk TMPDIR=/run/desk MOCAP_GUEST=1 MOCAP_BIN_DIR=$(quoted "$build/bin") MOCAP_REPLUG_ROUNDS=${MOCAP_REPLUG_ROUNDS:-}
export PATH=/usr/sbin:/usr/bin:/sbin:/bin PYTHONDONTWRITEBYTECODE=1
if [ $vivid != 0 ]; then
  export MOCAP_V4L2_DEVICE=\$(ls /dev/video* | head -1)
  export MOCAP_VIVID_REMOVE="$busybox rmmod vivid"
  export MOCAP_VIVID_INSERT=$(quoted "$insert_vivid")" && while [ ! -e \$MOCAP_V4L2_DEVICE ]; do :; done"
fi
if [ $usb3 != 0 ]; then
  mkdir -p /etc/udev/rules.d /run/udev && mount -t tmpfs tmpfs /usr/lib/udev 2>/dev/null
  mkdir -p /usr/lib/udev/rules.d
  cp $(quoted "$cache/udev/lib/udev/rules.d/50-udev-default.rules") /usr/lib/udev/rules.d/
  cp $(quoted "$here/../../systemd/60-mocapd.rules") /etc/udev/rules.d/
  $(quoted "$cache/udev/bin/udevadm") info --version >/dev/null || echo "guest_vm: no udevadm"
  (exec -a systemd-udevd $(quoted "$cache/udev/bin/udevadm") --daemon --resolve-names=early)
fi
$(quoted "$program" "$@")
echo "guest_vm: exit \$?"
RUN
chroot /root /bin/bash /run/program
poweroff -f
END
chmod +x "$image/init"
(cd "$image" && find . | ${packer:-cpio} -o -H newc 2>/dev/null) >"$image.cpio"

flock -u 9 # the packages are complete: other machines may start

# The clock of the guest counts its instructions, 4 ns each (-icount): on a busy host, images and sound still come in the guest's
# own real time. A guest that waits does so in real time: else its clock leaps by minutes while it waits for a file of the host.
output=$cache/output.$$
timeout -k 2 "${MOCAP_GUEST_LIMIT_S:-240}" qemu-system-x86_64 -cpu max -accel tcg -icount shift=2,sleep=on -m 768 -nographic -no-reboot -nodefaults -serial stdio \
  -kernel "$kernel" -initrd "$image.cpio" -append "console=ttyS0 quiet no_timer_check mitigations=off no5lvl panic=-1 loglevel=3" \
  -virtfs local,path=/,mount_tag=root9p,security_model=none,readonly=on,multidevs=remap </dev/null 2>&1 |
  tr -d '\r' | tee "$output" || true
result=$(sed -n 's/^guest_vm: exit \([0-9]*\)$/\1/p' "$output" | tail -1)
[ -n "$result" ] || { echo "guest_vm: the machine ended without a result"; exit 1; }
exit "$result"
