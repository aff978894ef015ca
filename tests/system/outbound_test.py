"""Nothing leaves the host unasked: nftables counts the packets of the daemon, of the page and of the bridges with their default
configuration that are sent to another interface than loopback. A card with a default route takes them, as on a real machine.
Runs in its own network namespace; skipped without nftables or the right to use it.

Not unasked: GigE cameras (their discovery is a broadcast), [node] announcements, and each address in a configuration or option."""

import http.client
import json
import shutil
import socket
import subprocess
import sys
import unittest

from feed_client import Operator, Subscriber, control_pb2
from harness import Desk, synthetic_volume, until
from recording_daemon import TAKE

FEED = "tcp://127.0.0.1:5570"  # the default
ELSEWHERE = "10.78.0.7"
LONG_S = 120
SETS = 150  # 5 s: each program's timers have run, those of reconnections and statistics, too

CARD = """link add out0 type veth peer name peer0
addr add 10.78.0.1/24 dev out0
link set out0 up
link set peer0 up
route add default dev out0"""

RULES = """
table inet leaving {
  set destinations { type ipv4_addr . inet_proto . inet_service; flags dynamic; size 1000; }
  counter left {}
  chain output {
    type filter hook output priority 0;
    oifname "lo" accept
    meta l4proto { tcp, udp } add @destinations { ip daddr . meta l4proto . th dport }
    counter name left
  }
}
"""


def run(*command, text=None):
    done = subprocess.run(command, input=text, capture_output=True, text=True)
    if done.returncode != 0:
        print(f"skipped: {' '.join(command)}: {done.stderr.strip()}")
        sys.exit(77)
    return done.stdout


class Outbound(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if not shutil.which("nft", path="/usr/sbin:/sbin"):
            print("skipped: nft is missing; run tools/setup.sh --tests")
            sys.exit(77)
        with open("/proc/sys/net/ipv6/conf/all/disable_ipv6", "w") as setting:
            setting.write("1")  # the kernel announces addresses by itself
        for line in CARD.splitlines():
            run("ip", *line.split())
        run("/usr/sbin/nft", "-f", "-", text=RULES)

    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        run("/usr/sbin/nft", "reset", "counters")
        run("/usr/sbin/nft", "flush", "set", "inet", "leaving", "destinations")
        self.sent_before = self.sent_by_card()

    def start_all(self):
        """The programs with their default configuration; `feed` has the snapshots."""
        config = synthetic_volume(FEED).replace(f'[publish]\nendpoint = "{FEED}"\n', "")
        self.assertNotIn("[publish]", config)
        state = self.desk.folder / "state"
        state.mkdir()
        self.feed = Subscriber(FEED)
        self.addCleanup(self.feed.end)
        self.programs = [self.desk.start("mocapd", "--config", self.desk.write("mocapd.toml", config), "--state", state)]
        self.receivers = [receiver(39539), receiver(14043)]
        for each in self.receivers:
            self.addCleanup(each.close)
        for name in ("mocap-web", "mocap-vmc", "mocap-rokoko", "mocap-vrpn", "mocap-natnet"):
            self.programs.append(self.desk.start(name))

    def left(self):
        """The packets that left, and to where."""
        listed = json.loads(run("/usr/sbin/nft", "-j", "list", "ruleset"))["nftables"]
        packets = next(each["counter"]["packets"] for each in listed if "counter" in each)
        destinations = next(each["set"].get("elem", []) for each in listed if "set" in each)
        return packets, sorted(":".join(map(str, each["concat"])) for each in destinations)

    def sent_by_card(self):
        """Also what raw sockets send."""
        return json.loads(run("ip", "-s", "-j", "link", "show", "out0"))[0]["stats64"]["tx"]["packets"]

    def expect_work(self):
        """Each program does what it is for."""
        until(lambda: self.feed.newest, "a snapshot", LONG_S)
        for each in self.receivers:
            self.assertTrue(each.recv(65536))
        until(lambda: page_status() == 200, "the page", LONG_S)
        operator = Operator(FEED)
        self.addCleanup(operator.end)
        for action in (TAKE.ACTION_START, TAKE.ACTION_STOP):
            self.assertEqual(operator.order("take", action=action).code, control_pb2.CODE_DONE)
        number = self.feed.newest.number
        until(lambda: self.feed.newest.number > number + SETS, f"{SETS} more sets", LONG_S)
        for program in self.programs:
            self.assertIsNone(program.process.poll(), program.output())

    def test_daemon_page_and_bridges_send_nothing_beyond_loopback(self):
        self.start_all()
        self.expect_work()
        self.assertEqual(self.left(), (0, []))
        self.assertEqual(self.sent_by_card(), self.sent_before)

    def test_a_bridge_that_is_told_to_send_elsewhere_is_counted(self):
        self.start_all()
        self.desk.start("mocap-vmc", "--to", ELSEWHERE)
        until(lambda: self.left() != (0, []), "a packet to another host", LONG_S)
        self.assertEqual(self.left()[1], [f"{ELSEWHERE}:udp:39539"])


def receiver(port):
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.bind(("127.0.0.1", port))
    udp.settimeout(LONG_S)
    return udp


def page_status():
    connection = http.client.HTTPConnection("127.0.0.1", 5580, timeout=LONG_S)
    try:
        connection.request("GET", "/")
        return connection.getresponse().status
    except OSError:
        return None
    finally:
        connection.close()


if __name__ == "__main__":
    unittest.main(verbosity=2)
