#!/usr/bin/env bash
# Installs every Debian 12 package that the build, the demo and the tests need. Idempotent, asks nothing, needs no
# network where nothing is missing. Not run as root, it says what is missing and how to get it.
#
# usage: tools/setup.sh [--check]     --check: only say what is missing
set -euo pipefail

packages=(
  # build
  build-essential cmake ninja-build ccache pkg-config git
  # libraries
  libaravis-dev libusb-1.0-0-dev libopencv-dev libopencv-contrib-dev libeigen3-dev libceres-dev libhwy-dev libturbojpeg0-dev
  libzmq3-dev libprotozero-dev libprotobuf-dev protobuf-compiler libspdlog-dev libfmt-dev libsystemd-dev
  libcli11-dev libtomlplusplus-dev libyaml-cpp-dev nlohmann-json3-dev
  # tests and checks
  libgtest-dev libgmock-dev clang-format clang-tidy shellcheck iproute2 procps systemd
  systemd-container
  python3 python3-zmq python3-protobuf python3-numpy python3-liblo
  python3-pip python3-setuptools python3-wheel mono-mcs mono-runtime
  # a virtual machine, for a real V4L2 driver
  qemu-system-x86 busybox-static
)

check=false
case "${1:-}" in
  "") ;;
  --check) check=true ;;
  *) echo "setup: unknown argument '$1', expected --check or nothing" >&2; exit 64 ;;
esac

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
  echo "setup: this is no Debian; install what tools/setup.sh lists by your system's own means" >&2
  exit 69
fi

# One question for all: dpkg-query is slow to start. A package that was never known prints nothing.
installed=$(dpkg-query -W -f='${Package} ${Status}\n' "${packages[@]}" 2>/dev/null || true)
missing=()
for package in "${packages[@]}"; do
  grep -qF "$package install ok installed" <<<"$installed" || missing+=("$package")
done

if [ ${#missing[@]} -eq 0 ]; then
  exit 0
fi
if $check || [ "$(id -u)" -ne 0 ]; then
  {
    echo "setup: ${#missing[@]} packages are missing: ${missing[*]}"
    echo "setup: install them with: sudo apt-get install --no-install-recommends ${missing[*]}"
  } >&2
  exit 69
fi

echo "setup: installing ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if ! { apt-get update -qq && apt-get install -y -qq --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
  tail -n 20 "$log" >&2
  echo "setup: apt-get failed; nothing was built" >&2
  exit 69
fi
