#!/usr/bin/env bash
# Installs every Debian 12 package that the build, the demo and the tests need. Idempotent, asks nothing.
set -euo pipefail

packages=(
  # build
  build-essential cmake ninja-build ccache pkg-config git
  # libraries
  libaravis-dev libusb-1.0-0-dev libopencv-dev libeigen3-dev libceres-dev libturbojpeg0-dev
  libzmq3-dev libprotobuf-dev protobuf-compiler libspdlog-dev libfmt-dev libsystemd-dev
  libcli11-dev libtomlplusplus-dev nlohmann-json3-dev
  # tests and checks
  libgtest-dev libgmock-dev clang-format clang-tidy iproute2
  python3 python3-zmq python3-protobuf
)

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
  exit 0
fi
if [ "$(id -u)" -ne 0 ]; then
  echo "setup: these packages are missing: ${missing[*]}" >&2
  echo "setup: run as root: apt-get install --no-install-recommends ${missing[*]}" >&2
  exit 77
fi
echo "setup: installing ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
