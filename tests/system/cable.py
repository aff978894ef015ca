"""A second network namespace at the other end of a cable (veth), for tests with another machine."""

import subprocess

HERE, THERE = "10.77.0.1", "10.77.0.2"


def other_network(test):
    """Returns the process id whose network namespace has the address THERE; this one has HERE, on `host0`. Skips the test if
    the system allows none. Jumbo frames (MTU 9000)."""
    other = subprocess.Popen(["unshare", "--net", "sh", "-c", "echo there; exec sleep 600"], stdout=subprocess.PIPE, text=True)
    test.addCleanup(other.stdout.close)
    test.addCleanup(other.wait)
    test.addCleanup(other.kill)
    if other.stdout.readline() != "there\n":
        test.skipTest("the system allows no second network namespace")
    pid = str(other.pid)
    for words in (f"ip link add host0 mtu 9000 type veth peer name camera0 mtu 9000 netns {pid}",
                  f"ip addr add {HERE}/24 dev host0", "ip link set host0 up",
                  f"nsenter -t {pid} -n ip addr add {THERE}/24 dev camera0",
                  f"nsenter -t {pid} -n ip link set camera0 up", f"nsenter -t {pid} -n ip link set lo up"):
        done = subprocess.run(words.split(), capture_output=True, text=True)
        if done.returncode != 0:
            test.skipTest(f"no virtual cards here: {words}: {done.stderr.strip()}")
    test.addCleanup(subprocess.run, ["ip", "link", "del", "host0"], check=False)
    return pid
