"""The complete system with real programs: simulated GigE Vision cameras, the daemon, the feed. Runs in its own network
namespace (tools/own_network.sh), in which the cameras have their addresses."""

import json
import os
import signal
import time
import unittest

from harness import SOURCE, Desk, Program

CONFIG = """
[capture]
rig = "{source}/config/demo.rig.toml"

[align]
window_us = 4000

[publish]
endpoint = "{endpoint}"

[[subject]]
name = "actor"
marker_set = "{source}/config/markersets/openmocap18.toml"
"""

CAMERA = """
[[camera]]
name = "cam{number}"
driver = "aravis"
address = "{address}"
width_px = 640
height_px = 480
rate_hz = 60
exposure_us = 500
packet_socket = false
packet_size_bytes = 8000
clock = "utc"
"""


ABSENT = """
[[camera]]
name = "cam{number}"
driver = "aravis"
{which}
packet_socket = false
"""


def cameras_used(snapshot):
    return len(snapshot.get("views", {}).get("cameras", []))


def tracking(snapshot):
    return any(subject.get("phase") == "SUBJECT_PHASE_TRACKING" for subject in snapshot.get("subjects", []))


class Chain(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)

    def config(self):
        text = CONFIG.format(source=SOURCE, endpoint=self.desk.endpoint)
        for number in range(1, 5):
            text += CAMERA.format(number=number, address=f"127.0.0.{number + 1}")
        return self.desk.write("mocapd.toml", text)

    def simulate(self, *more):
        return self.desk.start("mocap-sim", "--serve", "--rig", SOURCE / "config/demo.rig.toml",
                               "--motion", "tpose:2,walk", *more)

    def test_a_killed_camera_is_reopened_while_the_others_continue(self):
        epoch = time.monotonic_ns() + 3_000_000_000
        sims = {n: self.simulate("--only", str(n), "--epoch", str(epoch)) for n in range(1, 5)}
        self.desk.start("mocapd", "--config", self.config())
        feed = self.desk.watch()
        feed.wait_for(lambda s: cameras_used(s) == 4 and tracking(s), 120, "four cameras and a subject")

        sims[3].send(signal.SIGKILL)
        feed.wait_for(lambda s: cameras_used(s) == 3 and tracking(s), 120, "the feed continues with three cameras")
        self.simulate("--only", "3", "--epoch", str(epoch))
        feed.wait_for(lambda s: cameras_used(s) == 4 and tracking(s), 120, "the fourth camera is back")

    def test_a_killed_subscriber_does_not_affect_the_feed(self):
        self.simulate()
        daemon = self.desk.start("mocapd", "--config", self.config())
        feed, victim = self.desk.watch(), self.desk.watch()
        feed.wait_for(tracking, 120, "a subject")
        victim.wait_for(tracking, 120, "a subject for the other, too")

        victim.program.send(signal.SIGKILL)
        before = feed.wait_for(lambda s: True, 120, "the feed continues")
        after = feed.wait_for(lambda s: int(s["number"]) >= int(before["number"]) + 120, 120, "for two seconds")

        self.assertIsNone(daemon.process.poll())
        self.assertGreaterEqual(int(after["number"]), int(before["number"]) + 120)

    def test_a_second_daemon_on_the_same_port_ends_with_69(self):
        self.simulate()
        config = self.config()
        self.desk.start("mocapd", "--config", config)
        self.desk.watch().wait_for(lambda s: True, 120, "a first snapshot")

        second = self.desk.run("mocapd", "--config", config)

        self.assertEqual(second.returncode, 69, second.stderr)
        self.assertIn(self.desk.endpoint, second.stderr)

    def test_sigterm_ends_the_daemon_within_a_second_with_exit_code_0(self):
        self.simulate()
        daemon = self.desk.start("mocapd", "--config", self.config())
        self.desk.watch().wait_for(tracking, 120, "a subject")

        begun = time.monotonic()
        daemon.send(signal.SIGTERM)
        code = daemon.wait(10)

        self.assertEqual(code, 0, daemon.output())
        self.assertLess(time.monotonic() - begun, 1.0)

    def test_sigterm_ends_the_daemon_within_a_second_while_it_searches_for_cameras(self):
        """The search takes a second, and longer for several cameras; SIGTERM is sent in each phase of the search."""
        ways = ['serial = "NOWHERE1"', 'device_name = "nowhere"', 'address = "127.0.0.4"', 'address = "127.0.0.77"']
        for name, absent in {"one": ways[:1], "all": ways}.items():
            text = CONFIG.format(source=SOURCE, endpoint=self.desk.endpoint)
            text += "".join(ABSENT.format(number=n, which=which) for n, which in enumerate(absent, 1))
            config = self.desk.write(f"{name}.toml", text)
            for phase_s in (0.1, 0.5, 0.9, 1.4, 2.3):
                with self.subTest(absent=name, phase_s=phase_s):
                    daemon = self.desk.start("mocapd", "--config", config)
                    self.wait_for_log(daemon, "started, cameras=")
                    time.sleep(phase_s)  # sets the phase of the search

                    begun = time.monotonic()
                    daemon.send(signal.SIGTERM)
                    code = daemon.wait(10)

                    self.assertEqual(code, 0, daemon.output())
                    self.assertLess(time.monotonic() - begun, 1.0, daemon.output())

    def test_a_missing_camera_is_logged_once(self):
        text = CONFIG.format(source=SOURCE, endpoint=self.desk.endpoint)
        text += ABSENT.format(number=1, which='serial = "NOWHERE1"')
        daemon = self.desk.start("mocapd", "--config", self.desk.write("absent.toml", text))

        self.wait_for_log(daemon, "no Aravis camera with serial NOWHERE1; found none")

        self.assertNotIn("still looking", daemon.output())

    def wait_for_log(self, program, words, timeout_s=60):
        limit = time.monotonic() + timeout_s
        while words not in program.output():
            self.assertIsNone(program.process.poll(), program.output())
            self.assertLess(time.monotonic(), limit, f"not said within {timeout_s} s: {words}\n{program.output()}")
            time.sleep(0.02)

    @unittest.skipIf(os.environ.get("MOCAP_SANITIZE"), "a sanitizer cannot keep the cameras' pace; replay_test scores there")
    def test_the_feed_matches_the_truth(self):
        truth, stream = self.desk.folder / "truth.jsonl", self.desk.folder / "stream.jsonl"
        sim = self.simulate("--write-truth", truth)
        self.desk.start("mocapd", "--config", self.config())
        self.desk.watch().wait_for(tracking, 120, "a subject")
        with open(stream, "wb") as out:
            watch = Program(self.desk.folder, "mocap-watch", self.desk.endpoint, "--json", "--seconds", "5", stdout=out)
            self.desk.callback(watch.end)
            self.assertEqual(watch.wait(30), 0, watch.output())
        sim.send(signal.SIGTERM)
        sim.wait(10)

        scored = self.desk.run("mocap-score", "--truth", truth, "--stream", stream, "--json")

        figures = json.loads(scored.stdout)
        self.assertEqual(figures["label_errors"], 0, figures)
        self.assertLess(figures["marker_rms_mm"], 2.0, figures)
        self.assertGreater(figures["frames"], 200, figures)


if __name__ == "__main__":
    unittest.main(verbosity=2)
