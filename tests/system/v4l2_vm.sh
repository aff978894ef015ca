#!/usr/bin/env bash
# Runs the V4L2 tests on a real kernel with the driver vivid, in a virtual machine that needs no KVM and no root: the
# host's own / is the guest's root (read-only, over 9p, under a tmpfs), so that the built test runs there as it is.
#
#   v4l2_vm.sh BUILD_DIR PROGRAM [ARGUMENT...]
#
# Exit: that of PROGRAM; 77 where no such machine can be had (says why). The kernel is fetched once into
# BUILD_DIR/v4l2_vm.
set -euo pipefail

build=$(realpath "$1")
shift
program=$(realpath "$1")
shift
cache=$build/v4l2_vm
mkdir -p "$cache"
exec 9>"$cache/lock"
flock 9

skip() {
  echo "v4l2_vm: skipped: $*"
  exit 77
}

command -v qemu-system-x86_64 >/dev/null || skip "qemu-system-x86_64 is missing; apt-get install qemu-system-x86"
busybox=$(command -v busybox) || skip "busybox is missing; apt-get install busybox-static"
{ ldd "$busybox" 2>&1 || true; } | grep -qE 'not a dynamic|statically linked' || skip "busybox is not static; apt-get install busybox-static"
command -v cpio >/dev/null || packer="$busybox cpio"

# The kernel: Debian's, unpacked and not installed.
if ! ls "$cache"/root/boot/vmlinuz-* >/dev/null 2>&1; then
  rm -rf "$cache/root" && mkdir -p "$cache/root"
  package=$(apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/.*Depends: \(linux-image-[0-9][^ ]*-amd64\).*/\1/p' | head -1)
  [ -n "$package" ] || skip "apt knows no linux-image-amd64"
  (cd "$cache" && apt-get download -qq "$package" >/dev/null 2>&1) || skip "cannot download $package"
  dpkg -x "$cache/$package"_*.deb "$cache/unpacking"
  rm -f "$cache"/*.deb
  release=$(ls "$cache/unpacking/lib/modules")
  "$busybox" depmod -b "$cache/unpacking" "$release" 2>/dev/null || true
  [ -s "$cache/unpacking/lib/modules/$release/modules.dep" ] || skip "cannot index the modules of $package"
  rm -rf "$cache/root" && mv "$cache/unpacking" "$cache/root"
fi
kernels=("$cache"/root/boot/vmlinuz-*)
kernel=${kernels[0]}
release=${kernel##*/vmlinuz-}
modules=$cache/root/lib/modules/$release

# A module and, before it, all that it needs, as paths below $modules.
with_needs() {
  local line
  line=$(grep -E "(^|/)$1\.ko:" "$modules/modules.dep") || skip "the kernel has no module $1"
  local needs=${line#*:}
  for path in $(echo "$needs" | tr ' ' '\n' | tac) ${line%%:*}; do echo "$path"; done
}
in_order() {
  for module in "$@"; do with_needs "$module"; done | awk '!seen[$0]++'
}

image=$cache/initramfs.$$
trap 'rm -rf "$image" "$image".cpio "$cache/output.$$"' EXIT
mkdir -p "$image"/{bin,modules,proc,sys,dev,lower,upper,root}
cp "$busybox" "$image/bin/busybox"
for path in $(in_order virtio_pci 9p 9pnet_virtio overlay); do
  cp "$modules/$path" "$image/modules/"
  echo "insmod /modules/$(basename "$path")" >>"$image/load"
done
vivid=$(with_needs vivid | tail -1)
quoted=$(printf '%q ' "$program" "$@")
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
mount -t tmpfs tmpfs /root/tmp
for each in proc sys dev; do mount -o bind /\$each /root/\$each; done
for path in $(in_order vivid | tr '\n' ' '); do
  options=; [ "\${path##*/}" = vivid.ko ] && options="n_devs=1 node_types=0x1 no_error_inj=0"
  insmod /root$modules/\$path \$options
done
chroot /root /bin/ip link set lo up 2>/dev/null
device=\$(ls /dev/video* | head -1)
cat >/root/tmp/run <<'RUN'
cd /tmp
export HOME=/tmp MOCAP_V4L2_DEVICE=\$1
export MOCAP_VIVID_REMOVE="$busybox rmmod vivid"
export MOCAP_VIVID_INSERT="$busybox insmod $modules/$vivid n_devs=1 node_types=0x1 no_error_inj=0 && while [ ! -e \$1 ]; do :; done"
shift
$quoted
echo "v4l2_vm: exit \$?"
RUN
chroot /root /bin/bash /tmp/run "\$device"
poweroff -f
END
chmod +x "$image/init"
(cd "$image" && find . | ${packer:-cpio} -o -H newc 2>/dev/null) >"$image.cpio"

output=$cache/output.$$
nice timeout 240 qemu-system-x86_64 -cpu max -accel tcg -m 768 -nographic -no-reboot -nodefaults -serial stdio \
  -kernel "$kernel" -initrd "$image.cpio" -append "console=ttyS0 quiet no_timer_check panic=-1 loglevel=3" \
  -virtfs local,path=/,mount_tag=root9p,security_model=none,readonly=on,multidevs=remap </dev/null 2>&1 |
  tr -d '\r' | tee "$output" || true
result=$(sed -n 's/^v4l2_vm: exit \([0-9]*\)$/\1/p' "$output" | tail -1)
[ -n "$result" ] || { echo "v4l2_vm: the machine ended without a result"; exit 1; }
exit "$result"
