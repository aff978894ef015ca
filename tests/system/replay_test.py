"""Two replays of the same image folders give identical and correct snapshots."""

import json
import unittest

from harness import SOURCE, Desk

CONFIG = """
[capture]
rig = "{source}/config/demo.rig.toml"

[publish]
endpoint = "{endpoint}"

[record]
snapshots = "{record}"

[[subject]]
name = "actor"
marker_set = "{source}/config/markersets/openmocap18.toml"
"""

CAMERA = """
[[camera]]
name = "cam{number}"
driver = "replay"
folder = "take/cam{number}"
speed = 0
"""


class Replay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.desk = Desk()
        cls.addClassCleanup(cls.desk.close)
        made = cls.desk.run("mocap-sim", "--folders", "take", "--rig", SOURCE / "config/demo.rig.toml", "--motion",
                            "tpose:2,walk", "--seconds", "6", "--write-truth", "truth.jsonl")
        assert made.returncode == 0, made.stderr

    def replay(self, name):
        config = CONFIG.format(source=SOURCE, endpoint=self.desk.endpoint, record=name)
        for number in range(1, 5):
            config += CAMERA.format(number=number)
        ended = self.desk.run("mocapd", "--config", self.desk.write(f"{name}.toml", config))
        self.assertEqual(ended.returncode, 0, ended.stderr)
        return self.desk.folder / name

    def test_the_same_images_give_the_same_snapshots_byte_for_byte(self):
        first = self.replay("first.pb").read_bytes()
        second = self.replay("second.pb").read_bytes()

        self.assertGreater(len(first), 100_000)
        self.assertEqual(first, second)

    def test_every_set_is_present_and_every_label_is_right(self):
        stream = self.replay("stream.jsonl")

        scored = self.desk.run("mocap-score", "--truth", "truth.jsonl", "--stream", stream, "--json")

        figures = json.loads(scored.stdout)
        snapshots = [json.loads(line) for line in stream.read_text().splitlines()]
        self.assertEqual(len(snapshots), 360)
        described = None
        for snapshot in snapshots:
            described = snapshot.get("description", {}).get("version", described)
            self.assertEqual(snapshot["descriptionVersion"], described)
        self.assertGreater(described, 1, "the body was fitted")
        self.assertEqual(figures["complete_share"], 1.0, figures)
        self.assertEqual(figures["label_errors"], 0, figures)
        self.assertLess(figures["marker_rms_mm"], 2.0, figures)


if __name__ == "__main__":
    unittest.main(verbosity=2)
