#!/usr/bin/env bash
# Runs a command in a network of its own, whose loopback has addresses for simulated cameras: 127.0.0.2 and on. A fake
# GigE camera listens only on an address that an interface really has; here it collides with nothing on the machine.
#
# usage: tools/own_network.sh COMMAND [ARGUMENT...]
# Exit code: the command's; 77 where the system allows no network namespace.
set -euo pipefail

if [ "${MOCAP_OWN_NETWORK:-}" != inside ]; then
  [ $# -gt 0 ] || { echo "usage: tools/own_network.sh COMMAND [ARGUMENT...]" >&2; exit 64; }
  namespaces=(--net)
  [ "$(id -u)" -eq 0 ] || namespaces=(--user --map-root-user --net)
  if ! unshare "${namespaces[@]}" true 2>/dev/null; then
    echo "own_network: the system allows no network namespace (unshare ${namespaces[*]}); run as root" >&2
    exit 77
  fi
  MOCAP_OWN_NETWORK=inside exec unshare "${namespaces[@]}" "$0" "$@"
fi

ip link set lo up
for host in $(seq 2 9); do ip addr add "127.0.0.$host/8" dev lo; done
unset MOCAP_OWN_NETWORK
exec "$@"
