"""Camera nodes: two daemons detect, a third one fuses their blobs; faults of one node leave the others alone."""

import signal
import subprocess
import unittest

from cable import THERE, other_network
from harness import BIN, GIGE_OF_DEMO_RIG, SOURCE, Desk, free_port, until

SUBJECT = f"""
[[subject]]
name = "actor"
marker_set = "{SOURCE}/config/markersets/openmocap18.toml"
"""

NODE = """
[node]
endpoint = "{node}"
name = "{name}"
{more}
[publish]
endpoint = "{feed}"
"""

HOST = """
[capture]
rig = "{source}/config/demo.rig.toml"
[publish]
endpoint = "{feed}"
"""

REPLAY = """
[[camera]]
name = "cam{number}"
driver = "replay"
folder = "take/cam{number}"
speed = 0
"""

SYNTHETIC = """
[[camera]]
name = "cam{number}"
driver = "synthetic"
rate_hz = 30
marker_set = "{source}/config/markersets/openmocap18.toml"
"""

REMOTE = """
[[camera]]
name = "cam{number}"
driver = "node"
endpoint = "{node}"
{more}
"""


def endpoint(address="127.0.0.1"):
    return f"tcp://{address}:{free_port()}"


class Nodes(unittest.TestCase):
    """A fusion host and the nodes `left` (cameras 1 and 2) and `right` (cameras 3 and 4)."""

    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        self.node = {name: endpoint() for name in ("left", "right")}

    def start_node(self, name, cameras, more=""):
        text = NODE.format(node=self.node[name], name=name, feed=endpoint(), more=more) + cameras
        return self.desk.start("mocapd", "--config", self.desk.write(f"{name}.toml", text))

    def host_config(self, more="", subject=SUBJECT):
        text = HOST.format(source=SOURCE, feed=self.desk.endpoint) + subject
        for number in range(1, 5):
            text += REMOTE.format(number=number, node=self.node["left" if number < 3 else "right"], more=more)
        return text

    @staticmethod
    def cameras(template, name):
        return "".join(template.format(number=number, address=number + 1, source=SOURCE) for number in ((1, 2) if name == "left" else (3, 4)))


class RecordedNodes(Nodes):
    def test_the_snapshots_of_two_nodes_equal_those_of_one_host_byte_for_byte(self):
        made = self.desk.run("mocap-sim", "--folders", "take", "--rig", SOURCE / "config/demo.rig.toml", "--motion",
                             "tpose:2,walk", "--seconds", "3")
        self.assertEqual(made.returncode, 0, made.stderr)
        alone = HOST.format(source=SOURCE, feed=endpoint()) + SUBJECT + '[record]\nsnapshots = "alone.pb"\n'
        alone += "".join(REPLAY.format(number=number) for number in range(1, 5))
        ended = self.desk.run("mocapd", "--config", self.desk.write("alone.toml", alone))
        self.assertEqual(ended.returncode, 0, ended.stderr)

        nodes = [self.start_node(name, self.cameras(REPLAY, name)) for name in ("left", "right")]
        fused = self.host_config("recorded = true\nrate_hz = 60") + '[record]\nsnapshots = "fused.pb"\n'
        ended = self.desk.run("mocapd", "--config", self.desk.write("fused.toml", fused))
        self.assertEqual(ended.returncode, 0, ended.stderr)
        for node in nodes:
            self.assertEqual(node.wait(60), 0, node.output())

        one, other = ((self.desk.folder / name).read_bytes() for name in ("alone.pb", "fused.pb"))
        self.assertGreater(len(one), 50_000)
        self.assertEqual(one, other)


class LiveNodes(Nodes):
    def serve_cameras(self):
        sim = self.desk.start("mocap-sim", "--serve", "--rig", SOURCE / "config/demo.rig.toml", "--fps", "30",
                              "--loop-images", "8")
        until(lambda: "served address" in sim.output(), "simulated cameras")

    def views(self, feed, count, what):
        return feed.wait_for(lambda snapshot: len(snapshot["views"]["cameras"]) == count, 60, what)

    def test_a_killed_node_takes_no_set_from_the_others_and_comes_back(self):
        self.serve_cameras()
        left = self.start_node("left", self.cameras(GIGE_OF_DEMO_RIG, "left"))
        self.start_node("right", self.cameras(GIGE_OF_DEMO_RIG, "right"))
        host = self.desk.start("mocapd", "--config", self.desk.write("host.toml", self.host_config()))
        feed = self.desk.watch()
        self.views(feed, 4, "sets of four views")

        left.send(signal.SIGKILL)
        first = self.views(feed, 2, "sets of two views")
        words = f"node 'left' at {self.node['left']} does not answer for more than 2 s"
        until(lambda: words in host.output(), "a line in the log that names the node")
        last = self.views(feed, 2, "sets of two views")
        span_s = (int(last["instants"]["exposedAtNs"]) - int(first["instants"]["exposedAtNs"])) / 1e9
        self.assertGreaterEqual(int(last["number"]) - int(first["number"]), round(30 * span_s))

        self.start_node("left", self.cameras(GIGE_OF_DEMO_RIG, "left"))
        self.views(feed, 4, "sets of four views again")

    def test_an_operator_changes_the_exposure_of_a_nodes_camera_through_the_host(self):
        self.serve_cameras()
        left = self.start_node("left", self.cameras(GIGE_OF_DEMO_RIG, "left"))
        self.start_node("right", self.cameras(GIGE_OF_DEMO_RIG, "right"))
        self.desk.start("mocapd", "--config", self.desk.write("host.toml", self.host_config()))
        self.views(self.desk.watch(), 4, "sets of four views")

        control = self.desk.endpoint.replace(port := self.desk.endpoint.rsplit(":", 1)[1], str(int(port) + 1))
        changed = self.desk.run("mocapctl", "camera", "set", "cam1", "--exposure-us", "700", "--endpoint", control)
        self.assertEqual(changed.returncode, 0, changed.stderr)
        until(lambda: "exposure=700" in left.output(), "the new exposure in the log of the node")

        refused = self.desk.run("mocapctl", "mask", "learn", "--camera", "cam1", "--endpoint", control)
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("learn its mask on its node", refused.stderr + refused.stdout)


class Keys(Nodes):
    def keys(self, *friends):
        """Makes the keys of the node `server` and of its friends; returns the section of the node that allows them."""
        for name in ("server", *friends):
            made = self.desk.run("mocapctl", "keys", "new", f"{name}.key")
            self.assertEqual(made.returncode, 0, made.stderr)
        for name in friends:
            allowed = self.desk.run("mocapctl", "keys", "allow", f"{name}.key", "--list", "allowed.keys", "--role",
                                    "operator", "--name", name)
            self.assertEqual(allowed.returncode, 0, allowed.stderr)
        return '[security]\nserver_key = "server.key"\nallowed_keys = "allowed.keys"\n'

    def rig(self):
        return f'[capture]\nrig = "{SOURCE}/config/demo.rig.toml"\n'

    def host(self, key):
        """A fusion host with the cameras of the node `left` and its own key."""
        text = HOST.format(source=SOURCE, feed=endpoint())
        for number in (1, 2):
            text += REMOTE.format(number=number, node=self.node["left"],
                                  more=f'server_key = "server.key"\nsecret_key = "{key}.key"\n')
        return self.desk.start("mocapd", "--config", self.desk.write(f"{key}.toml", text))


class Strangers(Keys):
    def test_a_host_with_an_unknown_key_gets_no_blob_and_one_line_in_the_log(self):
        security = self.keys("fusion")
        stranger_key = self.desk.run("mocapctl", "keys", "new", "stranger.key")
        self.assertEqual(stranger_key.returncode, 0, stranger_key.stderr)
        node = self.start_node("left", self.cameras(SYNTHETIC, "left"), self.rig() + security)
        friend = self.host("fusion")
        until(lambda: friend.output().count("streaming") == 2, f"two cameras: {friend.output()}")

        stranger = self.host("stranger")
        until(lambda: "refused a client" in node.output(), "a refusal in the log of the node")
        until(lambda: "does not answer" in stranger.output(), "a reason in the log of the host")

        self.assertNotIn("streaming", stranger.output())
        self.assertEqual(node.output().count("refused a client"), 1, node.output())


class Cut(Keys):
    """A node on another machine, with keys."""

    def test_a_cut_cable_is_reported_with_the_node_and_its_cameras_come_back(self):
        there = other_network(self)
        self.node["left"] = f"tcp://{THERE}:5575"
        text = NODE.format(node=self.node["left"], name="left", feed=endpoint(), more=self.rig() + self.keys("fusion"))
        config = self.desk.write("left.toml", text + self.cameras(SYNTHETIC, "left"))
        self.desk.start("/usr/bin/nsenter", "-t", there, "-n", BIN / "mocapd", "--config", config)
        host = self.host("fusion")
        until(lambda: host.output().count("streaming") == 2, f"two cameras: {host.output()}")

        subprocess.run(["ip", "link", "set", "host0", "down"], check=True)
        until(lambda: f"node 'left' at {self.node['left']} does not answer" in host.output(), "a line that names the node")
        subprocess.run(["ip", "link", "set", "host0", "up"], check=True)

        until(lambda: host.output().count("streaming") >= 4, f"both cameras again: {host.output()}")


if __name__ == "__main__":
    unittest.main()
