"""Four nodes on machines of their own, joined by a bridge: eight simulated GigE cameras, one fusion host. Prints what the nodes
cost in time. MOCAP_NODES_SECONDS: measured time (default 5)."""

import json
import os
import time
import unittest

import nodes_test
from cable import bridged_networks
from harness import BIN, GIGE_OF_DEMO_RIG, SOURCE, free_port, until

LONG_S = 120
NODES, CAMERAS_OF_A_NODE = 4, 2
SECONDS = float(os.environ.get("MOCAP_NODES_SECONDS", "5"))


class BridgedNodes(nodes_test.Nodes):
    def setUp(self):
        super().setUp()
        self.rig = self.desk.folder / "ring.rig.toml"
        made = self.desk.run("mocap-sim", "--ring", NODES * CAMERAS_OF_A_NODE, "--write-rig", self.rig)
        self.assertEqual(made.returncode, 0, made.stderr)
        self.epoch_ns = time.monotonic_ns()

    def start_machine(self, index, pid, address):
        """Starts two cameras and their node in a namespace; returns the cameras as the fusion host has them, and the node."""
        inside = ("/usr/bin/nsenter", "-t", pid, "-n")
        feed, node = f"tcp://127.0.0.1:{free_port()}", f"tcp://{address}:{free_port()}"
        text = nodes_test.NODE.format(node=node, name=f"node{index}", feed=feed, more="allow_remote = true\n")
        text += f'[capture]\nrig = "{self.rig}"\n'
        remote = ""
        for number in range(CAMERAS_OF_A_NODE * index, CAMERAS_OF_A_NODE * (index + 1)):
            self.desk.start(*inside, BIN / "mocap-sim", "--serve", "--rig", self.rig, "--only", number + 1, "--fps", "30", "--epoch",
                            self.epoch_ns, "--loop-images", "8", "--motion", "tpose:600")
            text += GIGE_OF_DEMO_RIG.format(number=number + 1, address=number + 2)
            remote += nodes_test.REMOTE.format(number=number + 1, node=node, more="allow_remote = true\n")
        return remote, self.desk.start(*inside, BIN / "mocapd", "--config", self.desk.write(f"node{index}.toml", text)), (inside, feed)

    def health(self, control, *inside):
        """The health of a daemon, which has none in its first second."""
        def told():
            asked = self.desk.run(*inside, BIN / "mocapctl", "status", "--json", "--endpoint", control)
            health = json.loads(asked.stdout)["status"].get("health", {}) if asked.returncode == 0 else {}
            return health if "sets" in health else None

        return until(told, f"the health at {control}", LONG_S)

    def test_eight_cameras_of_four_nodes_give_whole_sets(self):
        machines = [self.start_machine(index, *other) for index, other in enumerate(bridged_networks(self, NODES))]
        text = nodes_test.HOST.format(source=SOURCE, feed=self.desk.endpoint).replace(f"{SOURCE}/config/demo.rig.toml", str(self.rig))
        text += nodes_test.SUBJECT + "".join(remote for remote, _, _ in machines)
        host = self.desk.start("mocapd", "--config", self.desk.write("host.toml", text))
        feed = self.desk.watch()
        feed.wait_for(lambda snapshot: len(snapshot["views"]["cameras"]) == NODES * CAMERAS_OF_A_NODE, LONG_S, f"sets of eight views: {host.output()}")
        feed.wait_for(lambda snapshot: snapshot["subjects"] and snapshot["subjects"][0]["bones"], LONG_S, f"an actor: {host.output()}")

        before, began = self.health(self.control()), time.monotonic()
        until(lambda: time.monotonic() > began + SECONDS, "the end of the measurement", SECONDS + LONG_S)
        after = self.health(self.control())
        sets, complete = (int(after[name]) - int(before[name]) for name in ("sets", "completeSets"))
        print(f"{complete} of {sets} sets complete", flush=True)
        self.assertGreater(complete, 0)
        for name in ("p50Ns", "p99Ns"):
            own = [self.detection_us(name, self.health(control_of(there), *inside)) for _, _, (inside, there) in machines]
            print(f"added {name[:3]}: {self.detection_us(name, after) - sum(own) / len(own):.0f} us", flush=True)

    @staticmethod
    def detection_us(name, health):
        return next(float(each[name]) / 1e3 for each in health["latencies"] if each["stage"] == "LATENCY_STAGE_DETECT")


def control_of(feed):
    address, port = feed.rsplit(":", 1)
    return f"{address}:{int(port) + 1}"


if __name__ == "__main__":
    unittest.main(verbosity=2)
