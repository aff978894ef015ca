"""A signal ends mocap-sim between two images: the folders and the truth are whole."""

import signal
import unittest

from harness import Desk, until


class SimulatedFolders(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)

    def test_the_folders_and_the_truth_have_the_same_images_after_a_signal(self):
        sim = self.desk.start("mocap-sim", "--folders", "take", "--ring", "2", "--seconds", "100000",
                              "--write-truth", "truth.jsonl")
        until(lambda: len(list(self.desk.folder.glob("take/*/000003.pgm"))) == 2, "four images of both cameras")

        sim.send(signal.SIGTERM)

        self.assertEqual(sim.wait(120), 69)
        self.assertIn("ended by a signal after", sim.output())
        truth = (self.desk.folder / "truth.jsonl").read_text()
        self.assertTrue(truth.endswith("}\n"))
        cameras = sorted((self.desk.folder / "take").iterdir())
        self.assertEqual(len(cameras), 2)
        for camera in cameras:
            stamps = (camera / "timestamps.csv").read_text().splitlines()
            self.assertEqual(len(stamps) - 1, truth.count("\n"))
            self.assertEqual(len(list(camera.glob("*.pgm"))), truth.count("\n"))

    def test_the_truth_alone_has_whole_lines_after_a_signal(self):
        path = self.desk.folder / "truth.jsonl"
        sim = self.desk.start("mocap-sim", "--ring", "2", "--write-truth", "truth.jsonl", "--seconds", "1000000")
        until(lambda: path.exists() and path.stat().st_size > 0, "a part of the truth")

        sim.send(signal.SIGINT)

        self.assertEqual(sim.wait(120), 69)
        self.assertTrue(path.read_text().endswith("}\n"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
