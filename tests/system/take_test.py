"""Takes of a running daemon: start, stop, cancel, mark, next, what happened before, a kill, a reload. The feed loses no
set. Runs in its own network namespace."""

import json
import signal
import unittest

from harness import until
from takes import TakesTest


class Takes(TakesTest):
    def test_start_mark_and_stop_give_a_whole_take_with_its_quality(self):
        self.daemon()
        self.assertIn("takes/take_001.mcap", self.take("start", "--notes", "first try"))
        self.wait_for_recorded(60)
        self.take("mark", "prop fell")
        self.assertEqual(self.ctl("take", "start").returncode, 69)  # one is being recorded
        ended = self.take("stop")

        self.assertIn("ended", ended)
        shown = self.show("takes/take_001.mcap")
        self.assertEqual(shown["state"], "complete")
        self.assertEqual(shown["info"]["notes"], "first try")
        self.assertIn(shown["quality"]["quality"], ("good", "look", "bad"))
        self.assertGreaterEqual(shown["quality"]["sets"], 60)
        self.assertEqual(shown["quality"]["lost_images"], 0)
        for camera in range(1, 5):
            self.assertGreaterEqual(shown["topics"][f"blobs/cam{camera}"]["messages"], 60)
        self.assertIn("configuration/mocapd.toml", shown["files"])
        self.assertEqual(self.wait_for_take("ENDED")["name"], "take_001")
        self.expect_no_loss()
        self.assertEqual(self.ctl("take", "stop").returncode, 65)  # none is recorded

    def test_before_next_cancel_and_names(self):
        self.daemon()
        self.wait_for_sets(120)
        self.take("start", "walk", "--before", "3")
        self.take("stop")
        self.assertGreaterEqual(self.show("takes/walk.mcap")["seconds"], 2.5)
        again = self.ctl("take", "start", "walk")
        self.assertEqual(again.returncode, 65)
        self.assertIn("the next free name is 'walk-2'", again.stderr)

        self.take("start", "--slate", "run")
        self.take("next")
        self.take("cancel")
        names = sorted(path.name for path in (self.desk.folder / "takes").iterdir())
        self.assertEqual(names, ["run_001.mcap", "walk.mcap"])
        self.take("start", "--seconds", "1")
        self.wait_for_take("ENDED")

    def test_the_shot_list_is_followed_in_order_through_a_restart(self):
        daemon = self.daemon_with_state()
        self.desk.write("day.csv", "name,slate,notes,seconds\nwalk,A1,\"slow, calm\",\nrun,A2,,\nfall,,,2\n")
        self.desk.write("bad.csv", "name,seconds\nwalk,soon\n")
        refused = self.ctl("take", "shots", "import", "bad.csv")
        self.assertEqual(refused.returncode, 65)
        self.assertIn("bad.csv:2: seconds is 'soon'", refused.stderr)
        self.assertIn("3 shots, 3 left, next 'walk'", self.take("shots", "import", "day.csv"))
        self.assertIn("shot 'walk', 2 left, next 'run'", self.take("next"))
        self.take("next")
        self.take("cancel")  # run is to be taken again
        daemon.end()
        self.daemon_with_state()

        self.assertIn("shot 'run', 1 left, next 'fall'", self.take("next"))
        self.take("stop")
        self.assertIn("the last one of the list", self.take("next"))
        self.wait_for_take("ENDED")  # after 2 s
        self.assertEqual([shot["done"] for shot in json.loads(self.take("shots", "list", "--json"))["shots"]["shots"]], [True] * 3)
        self.assertIn("walk,A1,\"slow, calm\",,yes", self.take("shots", "list", "--csv"))
        self.assertIn("is empty", self.take("shots", "clear"))
        walk = self.show("state/takes/walk.mcap")
        self.assertEqual((walk["info"]["slate"], walk["info"]["notes"]), ("A1", "slow, calm"))
        names = sorted(path.name for path in (self.desk.folder / "state/takes").iterdir())
        self.assertEqual(names, ["fall.mcap", "run.mcap", "walk.mcap"])

    def test_a_kill_leaves_a_take_that_opens(self):
        daemon = self.daemon()
        self.take("start")
        self.wait_for_recorded(60)
        daemon.send(signal.SIGKILL)
        daemon.wait(30)

        path = self.desk.folder / "takes/take_001.mcap"
        repaired = self.desk.run("mocapctl", "take", "repair", path)
        self.assertEqual(repaired.returncode, 0, repaired.stderr)
        self.assertGreaterEqual(self.show(path)["quality"]["sets"], 60)

    def test_a_reload_goes_on_with_a_take(self):
        self.daemon()
        self.take("start")
        self.wait_for_sets(30)
        self.config("\n[label]\nmost_rms_mm = 21\n")
        self.assertEqual((reloaded := self.ctl("reload")).returncode, 0, reloaded.stderr)
        self.wait_for_sets(30)
        self.take("stop")

        shown = self.show("takes/take_001.mcap")
        self.assertEqual(shown["state"], "complete")
        self.assertEqual(shown["quality"]["lost_sets"], 0)
        self.assertGreaterEqual(shown["topics"]["description"]["messages"], 2)  # a fit may give another one

    def test_a_reload_that_changes_takes_ends_a_take_and_says_so(self):
        daemon = self.daemon()
        self.take("start")
        self.wait_for_recorded(30)
        self.config("before_s = 5")
        self.assertEqual((reloaded := self.ctl("reload")).returncode, 0, reloaded.stderr)
        until(lambda: "it ended early: a reload changed [takes]" in daemon.output(), "the reason of the end in the log")
        self.take("start")
        self.wait_for_recorded(30)
        self.take("stop")

        self.assertEqual(self.show("takes/take_001.mcap")["state"], "complete")
        self.assertEqual(self.show("takes/take_002.mcap")["quality"]["lost_sets"], 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
