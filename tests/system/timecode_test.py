"""Timecode of a running daemon: LTC from a WAV file that is played in real time, and UTC. Runs in its own network namespace.

The tests of Device need a sound card of snd-aloop; guest_vm.sh sound=1 runs them.
"""

import csv
import json
import os
import pathlib
import subprocess
import sys
import time
import unittest

import ltc
from harness import Desk, synthetic_volume, until

LONG_S = 600  # of a signal that must not end within a test
FRAME_S = 0.04


def seconds_of(timecode):
    """Seconds since midnight at 25 frames a second."""
    hours, minutes, seconds, frames = (int(timecode.get(key, 0)) for key in ("hours", "minutes", "seconds", "frames"))
    return 3600 * hours + 60 * minutes + seconds + FRAME_S * frames


def seconds_in(text):
    hours, minutes, seconds, frames = map(int, text.split(":"))
    return 3600 * hours + 60 * minutes + seconds + FRAME_S * frames


class WithTimecode(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        host, port = self.desk.endpoint.rsplit(":", 1)
        self.control = f"{host}:{int(port) + 1}"

    def config(self, timecode):
        return self.desk.write("mocapd.toml", self.cameras() +
                               f"\n[takes]\nmin_free_mb = 1\n[timecode]\nrate = \"25\"\n{timecode}\n")

    def cameras(self):
        return synthetic_volume(self.desk.endpoint)

    def daemon(self, timecode):
        return self.desk.start("mocapd", "--config", self.config(timecode))

    def ltc_daemon(self, seconds, more=""):
        ltc.write_wav(self.desk.folder / "ltc.wav", seconds)
        return self.daemon(f'source = "ltc"\nwav = "ltc.wav"\n{more}')

    def ctl(self, *arguments):
        return self.desk.run("mocapctl", *arguments, "--endpoint", self.control)

    def do(self, *arguments):
        done = self.ctl(*arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def health(self):
        asked = self.ctl("status", "--json")
        return (json.loads(asked.stdout)["status"].get("health") or {}) if asked.returncode == 0 else {}

    def wait_for(self, state):
        return until(lambda: (t := self.health().get("timecode")) and t["state"] == f"TIMECODE_STATE_{state}" and t,
                     f"timecode is {state}")

    def snapshot(self):
        return json.loads(self.do("snapshot", "--json"))["snapshot"]

    def show(self, path):
        shown = self.desk.run("mocapctl", "take", "show", path, "--json")
        self.assertEqual(shown.returncode, 0, shown.stderr)
        return json.loads(shown.stdout)["info"]


class Timecode(WithTimecode):
    def test_snapshots_take_and_export_have_the_timecode_of_the_signal(self):
        before = time.monotonic()
        self.ltc_daemon(LONG_S)
        health = self.wait_for("LOCKED")
        after = time.monotonic()
        self.assertTrue(health["locked"])
        self.assertIn("timecode 10:00:", self.do("status"))

        self.do("take", "start", "coded")
        offsets = []
        for _ in range(6):
            snapshot = self.snapshot()
            offsets.append(int(snapshot["instants"]["exposedAtNs"]) * 1e-9 - (seconds_of(snapshot["timecode"]) - 36000))
            self.assertEqual(snapshot["timecode"]["framesPerSecond"], 25)
            time.sleep(0.2)
        until(lambda: int((self.health().get("take") or {}).get("sets", 0)) >= 30, "30 sets in the take")
        self.do("take", "stop")

        # Each exposure is 0 to 1 frame after the start of its timecode frame; the signal began when the daemon started.
        self.assertLess(max(offsets) - min(offsets), FRAME_S + 0.005)
        self.assertGreater(min(offsets), before)
        self.assertLess(max(offsets), after)
        info = self.show("takes/coded.mcap")
        self.assertEqual(info["timecode_rate"], "25")
        self.assertRegex(info["start_timecode"], r"10:0\d:\d\d:\d\d")
        self.assertGreater(seconds_in(info["end_timecode"]), seconds_in(info["start_timecode"]))
        exported = self.desk.run("mocapctl", "take", "export", "takes/coded.mcap", "--format", "csv", "--out", "coded.csv")
        self.assertEqual(exported.returncode, 0, exported.stderr)
        lines = [line for line in (self.desk.folder / "coded.csv").read_text().splitlines() if not line.startswith("#")]
        rows = list(csv.DictReader(lines))
        self.assertEqual(rows[0]["timecode"], info["start_timecode"])
        self.assertAlmostEqual(seconds_in(rows[-1]["timecode"]), seconds_in(info["end_timecode"]), delta=FRAME_S + 0.001)

    def test_the_end_of_the_signal_is_told(self):
        self.ltc_daemon(4, "coast_s = 1")
        lost = self.wait_for("LOST")
        self.assertFalse(lost["locked"])
        self.assertGreater(int(lost["frames"]), 50)
        self.assertIn("ltc.wav' has ended", lost["sentence"])
        until(lambda: self.health()["timecode"]["ageS"] > lost["ageS"] + 1, "the age grows")
        self.assertNotIn("timecode", {key for key, value in self.snapshot().items() if value})
        doctor = self.desk.run("mocap-watch", self.desk.endpoint, "--doctor")
        self.assertEqual(doctor.returncode, 41, doctor.stdout + doctor.stderr)
        self.assertRegex(doctor.stdout + doctor.stderr, "no timecode for .* because file .* has ended")

    def test_a_take_starts_at_a_timecode(self):
        self.ltc_daemon(LONG_S)
        now = self.wait_for("LOCKED")["now"]
        wanted = seconds_of(now) + 4
        text = f"10:{int(wanted / 60) % 60:02}:{int(wanted) % 60:02}:12"
        self.assertIn(f"the take starts at {text}", self.do("take", "start", "at", "--at", text))
        until(lambda: int((self.health().get("take") or {}).get("sets", 0)) >= 10, "10 sets in the take")
        self.do("take", "stop")

        late = seconds_in(self.show("takes/at.mcap")["start_timecode"]) - seconds_in(text)
        self.assertIn(round(late / FRAME_S), (0, 1))  # the first exposure after the start of the frame
        refused = self.ctl("take", "start", "--at", "10:00:00:25")
        self.assertEqual(refused.returncode, 65)
        self.assertIn("10:00:00:25 does not exist at 25 frames per second", refused.stderr)

    def test_utc_is_the_time_of_day(self):
        self.daemon('source = "utc"')
        self.wait_for("LOCKED")
        snapshot = self.snapshot()
        utc = time.time_ns() - time.monotonic_ns()  # the host stamps exposures with its monotonic clock
        exposed = (int(snapshot["instants"]["exposedAtNs"]) + utc) * 1e-9 % 86400
        self.assertAlmostEqual(seconds_of(snapshot["timecode"]) + FRAME_S / 2, exposed, delta=FRAME_S)

        self.config('source = "none"')
        self.do("reload")
        until(lambda: "timecode" not in self.health(), "no source of timecode in health")
        self.assertIsNone(self.snapshot().get("timecode"))
        refused = self.ctl("take", "start", "--at", "10:00:00:00")
        self.assertIn("[timecode] source is", refused.stderr)

    def test_the_configuration_is_checked(self):
        config = self.config('source = "ltc"\nwav = "none.wav"')
        checked = self.desk.run("mocapd", "--check-config", config)
        self.assertEqual(checked.returncode, 78)
        self.assertIn("none.wav' cannot be read", checked.stdout + checked.stderr)
        config = self.config('source = "ltc"\ndevice = "none"')
        self.assertEqual(self.desk.run("mocapd", "--check-config", config).returncode, 0)
        self.desk.start("mocapd", "--config", config)
        searching = until(lambda: (t := self.health().get("timecode")) and t["sentence"] and t, "a reason")
        self.assertIn("no timecode because device 'none': cannot be opened", searching["sentence"])


@unittest.skipUnless("MOCAP_GUEST" in os.environ, "needs guest_vm.sh sound=1")
class Device(WithTimecode):
    def cameras(self):  # few images for an emulated processor
        return super().cameras().replace("rate_hz = 30", "rate_hz = 5")

    def play(self, hours):
        player = subprocess.Popen([sys.executable, pathlib.Path(__file__).parent / "ltc.py", "hw:0,0", str(LONG_S), str(hours)])
        self.addCleanup(player.wait)
        self.addCleanup(player.kill)
        return player

    def test_the_signal_is_followed_lost_and_followed_again(self):
        player = self.play(10)
        self.daemon('source = "ltc"\ndevice = "hw:0,1"\ncoast_s = 1')
        self.assertEqual(self.wait_for("LOCKED")["now"]["hours"], 10)
        offsets = []

        def five_agree():
            if "timecode" in (snapshot := self.snapshot()):
                offsets.append(int(snapshot["instants"]["exposedAtNs"]) * 1e-9 - seconds_of(snapshot["timecode"]))
            newest = offsets[-5:]
            return len(newest) == 5 and max(newest) - min(newest) < FRAME_S + 0.01

        # The signal itself jumps if its player ran empty on the emulated processor.
        until(five_agree, "five snapshots in a row with the timecode of the signal")

        player.kill()
        player.wait()
        lost = self.wait_for("LOST")
        self.assertFalse(lost["locked"])
        self.assertIn("hw:0,1", lost["sentence"])

        self.play(11)
        until(lambda: (t := self.health()["timecode"]).get("locked") and t["now"]["hours"] == 11, "the second signal is followed")


if __name__ == "__main__":
    unittest.main(verbosity=2)
