"""Other network namespaces at the other end of a cable (veth), for tests with other machines."""

import subprocess

HERE, THERE = "10.77.0.1", "10.77.0.2"


def other_network(test):
    """Returns the process id whose network namespace has the address THERE; this one has HERE, on `host0`. Skips the test if
    the system allows none. Jumbo frames (MTU 9000)."""
    pid = _namespace(test)
    _ip(test, f"ip link add host0 mtu 9000 type veth peer name camera0 mtu 9000 netns {pid}",
        f"ip addr add {HERE}/24 dev host0", "ip link set host0 up",
        f"nsenter -t {pid} -n ip addr add {THERE}/24 dev camera0",
        f"nsenter -t {pid} -n ip link set camera0 up", f"nsenter -t {pid} -n ip link set lo up")
    test.addCleanup(subprocess.run, ["ip", "link", "del", "host0"], check=False)
    return pid


def bridged_networks(test, count):
    """Returns `count` pairs of a process id, whose network namespace hangs at a bridge of this one, and its address. This one has
    HERE. Skips the test if the system allows none."""
    others = []
    _ip(test, "ip link add bridge0 type bridge", f"ip addr add {HERE}/24 dev bridge0", "ip link set bridge0 up")
    test.addCleanup(subprocess.run, ["ip", "link", "del", "bridge0"], check=False)
    for index in range(count):
        pid, address = _namespace(test), f"10.77.0.{2 + index}"
        card = f"port{index}"
        _ip(test, f"ip link add {card} type veth peer name camera0 netns {pid}", f"ip link set {card} master bridge0", f"ip link set {card} up",
            f"nsenter -t {pid} -n ip addr add {address}/24 dev camera0", f"nsenter -t {pid} -n ip link set camera0 up",
            f"nsenter -t {pid} -n ip link set lo up")
        others.append((pid, address))
    return others


def _namespace(test):
    other = subprocess.Popen(["unshare", "--net", "sh", "-c", "echo there; exec sleep 600"], stdout=subprocess.PIPE, text=True)
    test.addCleanup(other.stdout.close)
    test.addCleanup(other.wait)
    test.addCleanup(other.kill)
    if other.stdout.readline() != "there\n":
        test.skipTest("the system allows no second network namespace")
    return str(other.pid)


def _ip(test, *commands):
    for words in commands:
        done = subprocess.run(words.split(), capture_output=True, text=True)
        if done.returncode != 0:
            test.skipTest(f"no virtual cards here: {words}: {done.stderr.strip()}")
