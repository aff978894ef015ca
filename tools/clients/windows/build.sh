#!/usr/bin/env bash
# Builds the client library, its example and mocap-vmc for 64-bit Windows 10 and later, on Debian with MinGW-w64. ZeroMQ and
# libsodium are built from Debian's source packages and become part of the DLL, like the runtime of the compiler: the DLL
# and the programs need only Windows' own DLLs.
#
# usage: tools/clients/windows/build.sh [--refresh]
#   --refresh   get the source packages again, for a newer version of Debian
#
# result:
#   build/windows/mocap-client-windows/          also as mocap-client-VERSION-windows-x64.zip beside it
#     bin/mocap_client.dll                       for Unity (Plugins/x86_64), Unreal, or beside your program
#     bin/mocap_example.exe, bin/mocap-vmc.exe
#     include/mocap_client.h, mocap_client.hpp
#     lib/mocap_client.lib                       import library for Microsoft's linker and lld-link
#     lib/libmocap_client.dll.a                  import library for MinGW
#     licences/                                  of the project and of all that the DLL contains
#
# Needs the packages of tools/setup.sh --tests, and the network for the first run. Exit code 69: the compiler or the source
# packages are not available.
set -euo pipefail
cd "$(dirname "$0")/../../.."

refresh=false
case "${1:-}" in
  -h|--help) sed -n '2,/^set/s/^# \{0,1\}//p' "$0"; exit 0 ;;
  --refresh) refresh=true ;;
  '') ;;
  *) echo "windows: unknown argument '$1', expected --refresh or nothing" >&2; exit 64 ;;
esac

say() { echo "windows: $1 ($SECONDS s)"; }
fail() { echo "windows: $1" >&2; exit 69; }

build=$PWD/build/windows
sources=$build/sources
packages=(zeromq3 libsodium)

# Downloads the source packages with an apt configuration of its own, so that the system's lists stay as they are and root is
# not needed. apt checks the signature and dpkg-source the checksums.
fetch_sources() {
  local apt=$build/apt
  rm -rf "$apt" "$sources"
  mkdir -p "$apt/lists/partial" "$apt/archives/partial" "$sources"
  apt-get indextargets 'Created-By: Packages' 'Origin: Debian' 'Component: main' --format \
    "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] \$(REPO_URI) \$(RELEASE) main" >"$apt/sources.list"
  [ -s "$apt/sources.list" ] || fail "apt knows no package of Debian: run apt-get update"
  cat >"$apt/apt.conf" <<CONF
Dir::Etc::sourcelist "$apt/sources.list";
Dir::Etc::sourceparts "/dev/null";
Dir::State::lists "$apt/lists";
Dir::Cache "$apt";
APT::Sandbox::User "$(id -un)";
CONF
  if ! (cd "$sources" && export APT_CONFIG="$apt/apt.conf" && apt-get update && apt-get source --download-only "${packages[@]}") \
      >"$apt/log" 2>&1; then
    tail -n 5 "$apt/log" >&2
    rm -rf "$sources"
    fail "the source packages ${packages[*]} could not be downloaded"
  fi
  for package in "${packages[@]}"; do
    dpkg-source --no-check -x "$sources/$package"_*.dsc "$sources/$package" >>"$apt/log"
  done
  rm -r "$apt/lists"
}

configure() {
  cmake -G Ninja -S tools/clients/windows -B "$build" --toolchain "$PWD/tools/clients/windows/toolchain.cmake" -Wno-dev \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache \
    -DZEROMQ_SOURCE="$sources/zeromq3" -DSODIUM_SOURCE="$sources/libsodium" >"$build/configure.log" 2>&1 ||
    { tail -n 30 "$build/configure.log" >&2; exit 1; }
}

for program in x86_64-w64-mingw32-g++-posix llvm-dlltool ccache ninja; do
  command -v "$program" >/dev/null || fail "$program is not installed: run tools/setup.sh --tests"
done
mkdir -p "$build"
if $refresh || [ ! -f "$sources/zeromq3/CMakeLists.txt" ] || [ ! -d "$sources/libsodium/src" ]; then
  say "getting the source packages ${packages[*]}"
  fetch_sources
fi

# One cache for all copies of the project: what was compiled in another folder is not compiled again.
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$PWD} CCACHE_NOHASHDIR=1
[ -f "$build/build.ninja" ] || { say "configuring ZeroMQ and the client"; configure; }
say "building"
cmake --build "$build"
rm -rf "$build/mocap-client-windows"
cmake --install "$build" --component windows --prefix "$build/mocap-client-windows" >/dev/null
version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
zip=mocap-client-$version-windows-x64.zip
(cd "$build" && cmake -E tar cf "$zip" --format=zip mocap-client-windows)
say "made build/windows/mocap-client-windows and build/windows/$zip"
