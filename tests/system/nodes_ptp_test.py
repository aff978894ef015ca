"""A node on another machine whose clock and the clock of the fusion host follow one PTP grandmaster: two ptp4l over a virtual
cable, with time stamps of software, which only measure (free_running) and leave the clock of this machine alone."""

import json
import shutil
import signal
import unittest

import nodes_test
from cable import THERE, other_network
from harness import SOURCE, free_port, until

LONG_S = 120
PTP4L = """[global]
time_stamping software
free_running 1
uds_address {folder}/{name}
{role}
logAnnounceInterval -1
logSyncInterval -3
logMinDelayReqInterval -3
"""
PTP = '[ptp]\nsocket = "{folder}/{name}"\n'


class PtpNodes(nodes_test.Nodes):
    def setUp(self):
        super().setUp()
        for program in ("ptp4l", "pmc"):
            if shutil.which(program, path="/usr/sbin:/usr/bin") is None:
                self.skipTest(f"no {program} here; install linuxptp")
        self.there = ("/usr/bin/nsenter", "-t", other_network(self), "-n")

    def start_ptp4l(self, name, role, card, *enter):
        config = self.desk.write(f"{name}.cfg", PTP4L.format(folder=self.desk.folder, name=name, role=role))
        return self.desk.start(*enter, "/usr/sbin/ptp4l", "-f", config, "-i", card, "-m")

    def clocks(self):
        """Source and uncertainty of each camera's clock."""
        asked = self.desk.run("mocapctl", "status", "--json", "--endpoint", self.control())
        cameras = json.loads(asked.stdout)["status"].get("health", {}).get("cameras", []) if asked.returncode == 0 else []
        return [(each["clockSource"], each["clockUncertaintyUs"]) for each in cameras]

    def test_the_clock_of_a_node_is_known_by_ptp_as_long_as_ptp_runs(self):
        self.start_ptp4l("grandmaster", "priority1 10", "host0")
        slave = self.start_ptp4l("slave", "slaveOnly 1", "camera0", *self.there)
        node = f"tcp://{THERE}:{free_port()}"
        text = nodes_test.NODE.format(node=node, name="there", feed=nodes_test.endpoint(), more="allow_remote = true\n")
        text += f'[capture]\nrig = "{SOURCE}/config/demo.rig.toml"\n' + PTP.format(folder=self.desk.folder, name="slave")
        text += "".join(nodes_test.SYNTHETIC.format(number=number, source=SOURCE) for number in range(1, 5))
        far = self.desk.start(*self.there, nodes_test.BIN / "mocapd", "--config", self.desk.write("there.toml", text))

        text = nodes_test.HOST.format(source=SOURCE, feed=self.desk.endpoint) + PTP.format(folder=self.desk.folder, name="grandmaster")
        text += "".join(nodes_test.REMOTE.format(number=number, node=node, more="allow_remote = true\n") for number in range(1, 5))
        host = self.desk.start("mocapd", "--config", self.desk.write("host.toml", text))
        feed = self.desk.watch()

        def all_are(source):
            until(lambda: [each[0] for each in self.clocks()] == 4 * [source], f"clocks by {source}: {host.output()} {far.output()}", LONG_S)

        all_are("CLOCK_SOURCE_PTP")
        self.assertIn("is known by PTP", host.output())
        print(f"uncertainty by PTP: {self.clocks()[0][1]:.2f} us", flush=True)
        slave.send(signal.SIGKILL)
        slave.wait(LONG_S)
        all_are("CLOCK_SOURCE_RECEIPTS")
        print(f"uncertainty by echoes: {self.clocks()[0][1]:.2f} us", flush=True)
        feed.wait_for(lambda snapshot: len(snapshot["views"]["cameras"]) == 4, LONG_S, "sets of four views")


if __name__ == "__main__":
    unittest.main(verbosity=2)
