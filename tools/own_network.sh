#!/usr/bin/env bash
# Runs a command in a new network namespace whose loopback interface has addresses for simulated cameras: 127.0.0.2 to
# 127.0.0.9. A simulated GigE camera can listen only on an address of an interface; the namespace avoids conflicts with the
# network of the machine.
#
# usage: tools/own_network.sh COMMAND [ARGUMENT...]
# Exit code: that of the command; 77 if the system does not allow network namespaces.
set -euo pipefail

if [ "${MOCAP_OWN_NETWORK:-}" != inside ]; then
  [ $# -gt 0 ] || { echo "usage: tools/own_network.sh COMMAND [ARGUMENT...]" >&2; exit 64; }
  namespaces=(--net)
  [ "$(id -u)" -eq 0 ] || namespaces=(--user --map-root-user --net)
  if ! unshare "${namespaces[@]}" true 2>/dev/null; then
    echo "own_network: the system does not allow a network namespace (unshare ${namespaces[*]}); run as root" >&2
    exit 77
  fi
  MOCAP_OWN_NETWORK=inside exec unshare "${namespaces[@]}" "$0" "$@"
fi

ip link set lo up
for host in $(seq 2 9); do ip addr add "127.0.0.$host/8" dev lo; done
unset MOCAP_OWN_NETWORK
exec "$@"
