"""A few crash cycles (crash_cycles.py), and that their checks see what is wrong. Runs in its own network namespace."""

import os
import unittest

from crash_cycles import CrashCycles
from harness import Desk
from recording_daemon import Violation, toml_faults
from take_file import Damaged, read_take

# On a machine with other load, the thread that writes a take may wait for its turn: more than on a calm one is then missing.
KEPT_MS_UNDER_LOAD = 1000
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
CYCLES = 2 if os.environ.get("MOCAP_SANITIZE") else 10


class Cycles(unittest.TestCase):
    def test_a_killed_daemon_leaves_whole_files_and_comes_back(self):
        with Desk() as desk:
            cycles = CrashCycles(1, desk, KEPT_MS_UNDER_LOAD)
            totals = cycles.run(CYCLES)
            print(totals, flush=True)
            self.assertGreater(totals.snapshots, 0)
            self.assertGreater(totals.orders["take start"], 0)
            self.expect_seen(cycles, next(iter(cycles._finished)))

    def expect_seen(self, cycles, path):
        """The checks detect each kind of damage that a killed daemon must not leave."""
        content = path.read_bytes()
        place = content.index(ZSTD_MAGIC) + 20
        path.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1:])
        with self.assertRaises(Damaged):
            read_take(path)
        with self.assertRaisesRegex(Violation, "was changed"):
            cycles.run(0)
        path.write_bytes(content)
        cycles.run(0)
        path.unlink()
        with self.assertRaisesRegex(Violation, "were removed"):
            cycles.check_takes(None, [], None, None)
        cycles.daemon.log.write_bytes(cycles.daemon.log.read_bytes()[:-1])
        with self.assertRaisesRegex(Violation, "became shorter"):
            cycles.check_audit([])
        (cycles.daemon.state / "half.toml").write_text("[rig\n")
        self.assertEqual(len(toml_faults(cycles.daemon.state)), 1)


class TakeFiles(unittest.TestCase):
    def test_an_empty_file_has_no_message(self):
        with Desk() as desk:
            self.assertEqual(read_take(desk.write("empty.mcap", "")).messages, [])
            with self.assertRaises(Damaged):
                read_take(desk.write("other.mcap", "no take"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
