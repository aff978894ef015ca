"""Takes that other programs start and stop over UDP: XML, Xsens, OSC, senders, programs that follow, a network that loses, repeats and
reorders packets. Runs in its own network namespace. MOCAP_TRIGGERS: takes of the last one (default 40)."""

import heapq
import json
import os
import random
import re
import signal
import socket
import struct
import threading
import time
import unittest
import xml.etree.ElementTree as ElementTree

from harness import Desk, synthetic_volume

LIMIT_S = 120  # of a failing test
XML_PORT, XSENS_PORT, OSC_PORT = 8989, 6004, 8000
DAEMON, CONTROLLER, STRANGER, FOLLOWER = "127.0.0.2", "127.0.0.3", "127.0.0.4", "127.0.0.5"


def capture(root, name, packet_id, **more):
    """A packet as Vicon and others send it, with the zero byte at its end."""
    values = {"Name": name, "Notes": "", "DatabasePath": "D:/Captures", "Delay": "0", "PacketID": packet_id} | more
    result = "" if root == "CaptureStart" else ' RESULT="SUCCESS"'
    elements = "".join(f'<{key} VALUE="{value}"/>' for key, value in values.items())
    return f'<?xml version="1.0" encoding="UTF-8" standalone="no"?><{root}{result}>{elements}</{root}>\0'.encode()


class Packet:
    """An XML packet that was received."""

    def __init__(self, data):
        tree = ElementTree.fromstring(data.rstrip(b"\0"))
        self.data = data
        self.root = tree.tag
        self.result = tree.get("RESULT")
        self.values = {child.tag: child.get("VALUE") for child in tree}

    def __repr__(self):
        return repr(self.data)


class Peer:
    """A program at an address of its own."""

    def __init__(self, address, port=0):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((address, port))
        self.socket.settimeout(LIMIT_S)

    def send(self, data, port=XML_PORT, to=DAEMON):
        self.socket.sendto(data, (to, port))

    def receive(self):
        return self.socket.recv(10000)

    def packet(self):
        return Packet(self.receive())

    def expect(self, test, root, name, packet_id=None, result=None):
        packet = self.packet()
        test.assertEqual((packet.root, packet.values["Name"], packet.result), (root, name, result), packet)
        if packet_id is not None:
            test.assertEqual(packet.values["PacketID"], packet_id)
        return packet

    def silent(self):
        """Whether nothing waits."""
        self.socket.setblocking(False)
        try:
            return not self.socket.recv(10000)
        except BlockingIOError:
            return True
        finally:
            self.socket.settimeout(LIMIT_S)

    def close(self):
        self.socket.close()


def osc(address, types="", *values):
    def text(word):
        return word.encode() + b"\0" * (4 - len(word) % 4)
    return text(address) + text("," + types) + b"".join(
        text(value) if isinstance(value, str) else struct.pack(">i", value) for value in values)


class Lossy:
    """A network that loses every fifth packet, repeats some and delivers them up to 30 ms late, in any order."""

    def __init__(self, peer, seed):
        self.peer = peer
        self.random = random.Random(seed)
        self.waiting = []
        self.sent_at = {}  # by packet: its first delivery
        self.changed = threading.Condition()
        self.running = True
        self.thread = threading.Thread(target=self.deliver)
        self.thread.start()

    def send(self, key, data):
        with self.changed:
            for _ in range(self.random.choice((1, 1, 1, 2, 3))):
                if self.random.random() >= 0.2:
                    due = time.monotonic() + self.random.uniform(0, 0.03)
                    heapq.heappush(self.waiting, (due, key, data))
            self.changed.notify()

    def loses(self):
        return self.random.random() < 0.2

    def deliver(self):
        with self.changed:
            while self.running:
                now = time.monotonic()
                while self.waiting and self.waiting[0][0] <= now:
                    _, key, data = heapq.heappop(self.waiting)
                    self.sent_at.setdefault(key, time.monotonic())
                    self.peer.send(data)
                self.changed.wait(self.waiting[0][0] - now if self.waiting else None)

    def close(self):
        with self.changed:
            self.running = False
            self.changed.notify()
        self.thread.join()


class Triggers(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)

    def peer(self, address, port=0):
        peer = Peer(address, port)
        self.addCleanup(peer.close)
        return peer

    def config(self, trigger, name="mocapd.toml", endpoint=None, folder="takes"):
        more = f'\n[takes]\nmin_free_mb = 1\nfolder = "{folder}"\n[trigger]\n{trigger}\n'
        return self.desk.write(name, synthetic_volume(endpoint or self.desk.endpoint) + more)

    @staticmethod
    def listening(more=""):
        return (f'listen = "{DAEMON}"\nsenders = ["{CONTROLLER}"]\nxsens_ports = [{XSENS_PORT}]\nosc_ports = [{OSC_PORT}]\n' + more)

    def daemon(self, trigger, **more):
        daemon = self.desk.start("mocapd", "--config", self.config(trigger, **more))
        self.wait_for_sets(more.get("endpoint"))
        return daemon

    def ctl(self, *arguments, endpoint=None):
        host, port = (endpoint or self.desk.endpoint).rsplit(":", 1)
        return self.desk.run("mocapctl", *arguments, "--endpoint", f"{host}:{int(port) + 1}")

    def health(self, endpoint=None):
        asked = self.ctl("status", "--json", endpoint=endpoint)
        return (json.loads(asked.stdout)["status"].get("health") or {}) if asked.returncode == 0 else {}

    def until(self, holds, what):
        limit = time.monotonic() + LIMIT_S
        while not holds():
            self.assertLess(time.monotonic(), limit, f"not within {LIMIT_S} s: {what}")
            time.sleep(0.05)

    def wait_for_sets(self, endpoint=None):
        self.until(lambda: int(self.health(endpoint).get("sets", 0)) >= 30, "30 sets")

    def wait_for_log(self, daemon, pattern):
        self.until(lambda: re.search(pattern, daemon.output()), pattern)

    def show(self, path):
        shown = self.desk.run("mocapctl", "take", "show", path, "--json")
        self.assertEqual(shown.returncode, 0, shown.stderr)
        return json.loads(shown.stdout)

    def takes(self, folder="takes"):
        return sorted(path.name for path in (self.desk.folder / folder).glob("*"))

    def test_xml_starts_stops_and_completes_a_take(self):
        self.daemon(self.listening())
        controller = self.peer(CONTROLLER)
        controller.send(capture("CaptureStart", "walk &amp; run", "7", Notes="first try", Description="with a prop"))
        started = controller.expect(self, "CaptureStart", "walk & run", "7")
        self.assertEqual(started.values["DatabasePath"], str(self.desk.folder / "takes"))
        self.assertTrue(started.data.endswith(b"</CaptureStart>\0"))
        controller.send(capture("CaptureStart", "other", "8"))
        refused = controller.expect(self, "CaptureStop", "other", "8", "FAIL")
        self.assertIn("is being recorded", refused.values["Notes"])

        controller.send(capture("CaptureStop", "walk &amp; run", "9"))
        controller.expect(self, "CaptureStop", "walk & run", "9", "SUCCESS")
        controller.expect(self, "CaptureComplete", "walk & run", "9", "SUCCESS")
        shown = self.show("takes/walk & run.mcap")  # at once: the file is complete
        self.assertEqual(shown["state"], "complete")
        self.assertEqual(shown["info"]["notes"], "first try\nwith a prop")
        self.assertEqual(self.takes(), ["walk & run.mcap"])

        controller.send(capture("CaptureStart", "walk &amp; run", "10"))
        refused = controller.expect(self, "CaptureStop", "walk & run", "10", "FAIL")
        self.assertIn("the next free name is", refused.values["Notes"])

    def test_a_delay_is_a_countdown(self):
        self.daemon(self.listening())
        controller = self.peer(CONTROLLER)
        controller.send(capture("CaptureStart", "walk", "7", Delay="60000"))
        controller.expect(self, "CaptureStart", "walk", "7")
        self.until(lambda: self.health().get("take", {}).get("state") == "TAKE_STATE_WAITING", "the take waits")
        controller.send(capture("CaptureStop", "walk", "8"))
        controller.expect(self, "CaptureStop", "walk", "8", "CANCEL")
        controller.send(capture("CaptureStart", "walk", "9", Delay="200"))
        controller.expect(self, "CaptureStart", "walk", "9")
        self.until(lambda: self.health().get("take", {}).get("state") == "TAKE_STATE_RECORDING", "the take is recorded")

    def test_xsens_and_osc(self):
        self.daemon(self.listening())
        controller = self.peer(CONTROLLER)
        controller.send(b'<StartRecordingReq SessionName="C:/mvn/session_01"/>\0', XSENS_PORT)
        self.assertEqual(controller.receive(), b'<StartRecordingAck Result="TRUE"/>\0')
        controller.send(b"<StopRecordingReq/>", XSENS_PORT)
        self.assertEqual(controller.receive(), b'<StopRecordingAck Result="TRUE"/>\0')
        self.until(lambda: self.health().get("take", {}).get("state") == "TAKE_STATE_ENDED", "the take ended")

        controller.send(osc("/RecordStart", "si", "run", 3), OSC_PORT)
        self.assertEqual(controller.receive(), osc("/RecordStartConfirm", "s", "00:00:00.000"))
        controller.send(osc("/RecordStop"), OSC_PORT)
        path = self.desk.folder / "takes/run_003.mcap"
        self.assertEqual(controller.receive(), osc("/RecordStopConfirm", "sss", "00:00:00.000", "run_003", str(path)))
        self.assertEqual(self.show(path)["info"]["slate"], "run")
        self.assertEqual(self.takes(), ["run_003.mcap", "session_01.mcap"])

    def test_other_senders_and_other_packets_are_refused(self):
        daemon = self.daemon(self.listening())
        stranger, controller = self.peer(STRANGER), self.peer(CONTROLLER)
        for _ in range(20):
            stranger.send(capture("CaptureStart", "walk", "7"))
        controller.send(b"<!DOCTYPE a [<!ENTITY b 'c'>]><CaptureStart/>")
        controller.send(b"x" * 9000)
        controller.send(capture("CaptureStop", "walk", "8"))
        controller.expect(self, "CaptureStop", "walk", "8", "FAIL")  # the packets before are refused by now

        self.assertTrue(stranger.silent())
        self.assertEqual(self.takes(), [])
        self.wait_for_log(daemon, r"warn\s+trigger: refused a packet from 127\.0\.0\.4, not in \[trigger\] senders")
        self.wait_for_log(daemon, r"trigger: refused a packet from 127\.0\.0\.3: has a document type")
        self.wait_for_log(daemon, r"trigger: refused a packet from 127\.0\.0\.3: has over 8192 bytes")
        self.wait_for_log(daemon, r"trigger: refused stop from 127\.0\.0\.3: no take is being recorded")

    def test_a_list_of_senders_is_required(self):
        refused = self.desk.run("mocapd", "--config", self.config(f'listen = "{DAEMON}"'))
        self.assertEqual(refused.returncode, 78)
        self.assertIn("senders is empty, expected the IPv4 addresses", refused.stderr)

    def test_a_port_in_use_is_named(self):
        self.peer(DAEMON, XML_PORT)
        refused = self.desk.run("mocapd", "--config", self.config(self.listening()))
        self.assertEqual(refused.returncode, 69)
        self.assertIn("cannot listen on 127.0.0.2 UDP port 8989", refused.stderr)

    def test_receivers_follow_the_takes_of_operators(self):
        daemon = self.daemon(self.listening(f'xml_receivers = ["{FOLLOWER}:30"]\nosc_receivers = ["{FOLLOWER}:9000"]'))
        follower, unreal = self.peer(FOLLOWER, 30), self.peer(FOLLOWER, 9000)
        self.assertEqual(self.ctl("take", "start", "walk").returncode, 0)
        data, daemon_address = follower.socket.recvfrom(10000)
        told = Packet(data)
        self.assertEqual((told.root, told.values["Name"]), ("CaptureStart", "walk"))
        follower.socket.sendto(data, daemon_address)  # confirms as Shogun does
        self.assertEqual(unreal.receive(), osc("/RecordStart", "si", "walk", 1))
        self.wait_for_log(daemon, r"127\.0\.0\.5 confirms start of 'walk'")
        self.assertEqual(self.ctl("take", "stop").returncode, 0)
        follower.expect(self, "CaptureStop", "walk", result="SUCCESS")
        follower.expect(self, "CaptureComplete", "walk", result="SUCCESS")
        self.assertEqual(unreal.receive(), osc("/RecordStop"))
        self.assertTrue(follower.silent())

        self.assertEqual(self.ctl("take", "start", "run").returncode, 0)
        follower.expect(self, "CaptureStart", "run")
        daemon.send(signal.SIGTERM)
        follower.expect(self, "CaptureStop", "run", result="SUCCESS")
        follower.expect(self, "CaptureComplete", "run", result="SUCCESS")
        self.assertEqual(daemon.wait(LIMIT_S), 0)
        self.assertEqual(self.show("takes/run.mcap")["state"], "complete")

    def test_two_daemons_follow_each_other_without_an_echo(self):
        def mutual(own, other):
            return f'listen = "{own}"\nsenders = ["{other}"]\nxml_receivers = ["{other}:{XML_PORT}"]'
        host, port = self.desk.endpoint.rsplit(":", 1)
        other_endpoint = f"{host}:{int(port) + 2}"
        one = self.daemon(mutual(DAEMON, FOLLOWER), folder="one")
        other = self.daemon(mutual(FOLLOWER, DAEMON), name="other.toml", endpoint=other_endpoint, folder="other")
        for endpoint, name in ((None, "walk"), (other_endpoint, "run")):
            self.assertEqual(self.ctl("take", "start", name, endpoint=endpoint).returncode, 0)
            for each in (one, other):
                self.wait_for_log(each, f"recording '.*{name}.mcap'")
            self.assertEqual(self.ctl("take", "stop", endpoint=endpoint).returncode, 0)
            for each in (one, other):
                self.wait_for_log(each, f"'.*{name}.mcap' ended")
        # The next request comes after all packets before it.
        self.assertEqual(self.ctl("take", "start", "last").returncode, 0)
        for each in (one, other):
            self.wait_for_log(each, "recording '.*last.mcap'")
            self.assertEqual(len(re.findall("recording '", each.output())), 3)
        self.assertEqual(self.takes("one"), ["last.mcap", "run.mcap", "walk.mcap"])
        self.assertEqual(self.takes("other"), ["last.mcap", "run.mcap", "walk.mcap"])

    def reload(self, trigger):
        self.config(trigger)
        self.assertEqual((done := self.ctl("reload")).returncode, 0, done.stderr)
        self.assertEqual(self.ctl("status").returncode, 0)  # is answered when the new configuration is in force

    def test_a_reload_opens_the_ports_and_a_take_goes_on(self):
        self.daemon('listen = "none"')
        controller, answers = self.peer(CONTROLLER), self.peer(CONTROLLER, 6005)
        self.reload(self.listening())
        controller.send(capture("CaptureStart", "walk", "7"))
        controller.expect(self, "CaptureStart", "walk", "7")
        self.reload(self.listening("xml_answer_port = 6005"))
        controller.send(capture("CaptureStop", "walk", "8"))
        answers.expect(self, "CaptureStop", "walk", "8", "SUCCESS")
        answers.expect(self, "CaptureComplete", "walk", "8", "SUCCESS")
        self.assertEqual(self.takes(), ["walk.mcap"])

    def test_a_network_that_loses_repeats_and_reorders(self):
        count = int(os.environ.get("MOCAP_TRIGGERS", "40"))
        daemon = self.daemon(self.listening())
        network = Lossy(self.peer(CONTROLLER), 1)
        self.addCleanup(network.close)
        took_s = {}

        def exchange(root, name, packet_id, wanted):
            """Sends a packet until every wanted answer arrived."""
            data, missing, limit = capture(root, name, packet_id), set(wanted), time.monotonic() + LIMIT_S
            while missing:
                self.assertLess(time.monotonic(), limit, f"no {missing} for {name}")
                network.send((root, packet_id), data)
                resend_at = time.monotonic() + 0.2
                while missing and (left := resend_at - time.monotonic()) > 0:
                    network.peer.socket.settimeout(left)
                    try:
                        answer = network.peer.packet()
                    except TimeoutError:
                        break
                    key = (answer.root, answer.values["PacketID"])
                    took_s.setdefault(key, time.monotonic() - network.sent_at.get(key, time.monotonic()))
                    if network.loses() or answer.values["PacketID"] != packet_id:
                        continue
                    self.assertEqual(answer.result, None if answer.root == "CaptureStart" else "SUCCESS", answer)
                    missing.discard(answer.root)

        for i in range(count):
            exchange("CaptureStart", f"take{i}", str(2 * i), ["CaptureStart"])
            exchange("CaptureStop", f"take{i}", str(2 * i + 1), ["CaptureStop", "CaptureComplete"])

        self.assertEqual(self.takes(), sorted(f"take{i}.mcap" for i in range(count)))
        self.assertEqual(len(re.findall(r"take: recording '", daemon.output())), count)
        for i in range(0, count, max(1, count // 20)):
            self.assertEqual(self.show(f"takes/take{i}.mcap")["state"], "complete")
        for root in ("CaptureStart", "CaptureStop"):
            times = sorted(s for (of, _), s in took_s.items() if of == root)
            print(f"{root}: {len(times)} replies, p50 {1e3 * times[len(times) // 2]:.2f} ms, "
                  f"p99 {1e3 * times[len(times) * 99 // 100]:.2f} ms, most {1e3 * times[-1]:.2f} ms")


if __name__ == "__main__":
    unittest.main(verbosity=2)
