#!/usr/bin/env bash
# Installs the Debian 12 packages that the build, the demo and the client examples need. Idempotent and non-interactive;
# needs no network if nothing is missing. Without root, prints the missing packages and the command that installs them.
#
# usage: tools/setup.sh [--tests] [--packages] [--check]
#   --tests      also the packages of tests and checks: compilers of other languages, a virtual machine, a container, and
#                independent readers of takes and exported files from npm (tests/*/npm)
#   --packages   also what tools/package.sh needs
#   --check      only print what is missing
set -euo pipefail

packages=(
  # build
  build-essential cmake ninja-build ccache pkg-config git
  # libraries
  libaravis-dev libusb-1.0-0-dev libopencv-dev libopencv-contrib-dev libeigen3-dev libceres-dev libhwy-dev libturbojpeg0-dev libpng-dev
  libzmq3-dev libprotozero-dev libprotobuf-dev protobuf-compiler libspdlog-dev libfmt-dev libsystemd-dev
  libcli11-dev libboost-dev libssl-dev libtomlplusplus-dev libyaml-cpp-dev nlohmann-json3-dev libzstd-dev liblz4-dev zlib1g-dev
  libexpat1-dev libltc-dev libasound2-dev libnats-dev
  # the page of mocap-web, whose npm packages are installed if npm is there
  esbuild
  # the demo (own network of the simulated cameras) and clients in Python
  iproute2 procps python3 python3-zmq python3-protobuf python3-numpy
)
test_packages=(
  libgtest-dev libgmock-dev clang-format clang-tidy shellcheck systemd systemd-container python3-liblo
  python3-lz4 python3-zstandard python3-pip python3-setuptools python3-wheel python3-venv mono-mcs mono-runtime zip
  # files that fail, and packets that leave the host
  libfiu-dev fiu-utils nftables
  # the server to which mocap-relay sends, and takes tracked again by a farm
  nats-server slurmctld slurmd slurm-client munge parallel
  # the browser of the page's tests
  chromium
  # promtool, which checks metrics and alert rules
  prometheus
  # a virtual machine, for a real V4L2 driver
  qemu-system-x86 busybox-static
  # nodes that announce themselves, and whose clocks follow PTP
  avahi-daemon linuxptp
  # the client library for Windows: compiler, tools for Microsoft's import library, and Wine to run it
  g++-mingw-w64-x86-64-posix llvm lld wine64
)
packaging_packages=(debhelper dh-python help2man lintian python3-setuptools)
# The tests also build the packages, install them and try the completions.
test_packages+=("${packaging_packages[@]}" bash-completion fish zsh man-db apt sudo)

check=false
tests=false
for argument in "$@"; do
  case "$argument" in
    --tests) tests=true; packages+=("${test_packages[@]}") ;;
    --packages) packages+=("${packaging_packages[@]}") ;;
    --check) check=true ;;
    *) echo "setup: unknown argument '$argument', expected --tests, --packages, --check or nothing" >&2; exit 64 ;;
  esac
done

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
  echo "setup: this is not Debian; install the packages that tools/setup.sh lists with your package manager" >&2
  exit 69
fi

# Node.js may come from elsewhere than Debian.
if $tests && ! command -v npm >/dev/null; then packages+=(nodejs npm); fi

# Without a network npm would otherwise try for minutes.
npm_options=(--ignore-scripts --no-audit --no-fund --silent --prefer-offline --fetch-retries 1 --fetch-retry-mintimeout 1000
  --fetch-retry-maxtimeout 1000)

# Installs npm packages as a lock file names them. Without them, WHAT.
npm_ci() {  # LOCK WHAT
  local folder
  folder=$(dirname "$1")
  if [ ! -e "$1" ] || [ -e "$folder/node_modules/.package-lock.json" ] || ! command -v npm >/dev/null; then return 0; fi
  npm ci --prefix "$folder" "${npm_options[@]}" || echo "setup: npm ci in $folder failed; $2" >&2
}

install_npm_packages() {
  local lock
  npm_ci "$(dirname "$0")/web/page/package-lock.json" "mocap-web is built without its page"
  $tests || return 0
  for lock in "$(dirname "$0")"/../tests/*/npm/package-lock.json; do npm_ci "$lock" "the tests with these packages are skipped"; done
}

# One query for all packages, because dpkg-query starts slowly. An unknown package prints nothing. A package that is held is installed too;
# the name has no architecture.
installed=$(dpkg-query -W -f='${Package} ${db:Status-Status}\n' "${packages[@]}" 2>/dev/null || true)
missing=()
for package in "${packages[@]}"; do
  grep -qxF "$package installed" <<<"$installed" || missing+=("$package")
done

if [ ${#missing[@]} -eq 0 ]; then
  $check || install_npm_packages
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
install_npm_packages
