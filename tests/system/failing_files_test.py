"""A daemon whose files fail: 5 % of open, read, write, fsync and rename below its state folder, drawn from a seed by libfiu. It
goes on, the feed loses nothing, what is lost is told, what is recorded is right, and all is well when the failures end. Runs in
its own network namespace. MOCAP_FAILING_SEEDS: number of seeds (default 3)."""

import collections
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import unittest

from crash_cycles import CrashCycles
from feed_client import Operator, Subscriber, control_pb2
from harness import BIN, SOURCE, Desk, until
from recording_daemon import SUBJECT, TAKE, OrderingThread, RecordingDaemon, check_messages, expect, toml_faults
from take_file import read_take

LIBRARY = pathlib.Path(os.environ.get("MOCAP_BUILD_DIR", "build/release")) / "lib/mocap_failing_files.so"
CONTROL = pathlib.Path("/usr/lib/fiu/fiu_run_preload.so")
SEEDS = int(os.environ.get("MOCAP_FAILING_SEEDS", "3"))
ORDERS = 40
ENABLE = "enable_random name=files/*,probability=0.05"
ENABLE_OFTEN = "enable_random name=files/*,probability=0.2"
DISABLE = "disable name=files/*"
LONG_S = 120
UNDER_LOAD_MS = 5000  # of a take; the daemon runs on for a while without memory

if not (LIBRARY.exists() and CONTROL.exists() and shutil.which("fiu-ctrl")):
    print(f"skipped: {LIBRARY} or fiu-ctrl is missing; run tools/setup.sh --tests and build the target mocap_failing_files")
    sys.exit(77)


class FailingFiles(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        self.daemon = RecordingDaemon(self.desk)
        self.state = self.daemon.state

    def start(self, seed, enable=""):
        return self.desk.start("/usr/bin/env", f"LD_PRELOAD={CONTROL} {LIBRARY}", f"FIU_CTRL_FIFO={self.desk.folder}/fiu",
                               f"FIU_ENABLE={enable}", f"MOCAP_FAILING_FOLDER={self.state}", f"MOCAP_FAILING_SEED={seed}",
                               BIN / "mocapd", *self.daemon.arguments)

    def fiu(self, program, command):
        done = subprocess.run(["fiu-ctrl", "-f", self.desk.folder / "fiu", "-c", command, str(program.process.pid)],
                              capture_output=True, text=True, timeout=LONG_S)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def operator(self):
        operator = Operator(self.desk.endpoint)
        self.addCleanup(operator.end)
        return operator

    def done(self, answer):
        self.assertEqual(answer.code, control_pb2.CODE_DONE, answer.message)
        return answer

    def end(self, program):
        program.send(signal.SIGTERM)
        self.assertEqual(program.wait(LONG_S), 0, program.output())

    def first_snapshot(self, feed, program):
        until(lambda: feed.newest is not None or program.process.poll() is not None, "the first snapshot", LONG_S)
        return program.process.poll() is None

    def test_what_fails_is_told_and_the_rest_is_right(self):
        for seed in range(1, SEEDS + 1):
            with self.subTest(seed=seed):
                program = self.start(seed)
                try:
                    self.run_with_failures(seed, program)
                finally:
                    program.end()

    def run_with_failures(self, seed, program):
        feed, operator = Subscriber(self.desk.endpoint), self.operator()
        self.assertTrue(self.first_snapshot(feed, program), program.output())
        before = set(self.daemon.takes.glob("*.mcap"))
        self.fiu(program, ENABLE)
        orders = OrderingThread(feed, self.desk.endpoint, seed, self.daemon.write_config)
        until(lambda: len(orders.answers) >= ORDERS or program.process.poll() is not None, f"{ORDERS} orders", LONG_S)
        orders.end()
        self.fiu(program, DISABLE)
        self.assertIsNone(program.process.poll(), program.output())
        operator.order("take", action=TAKE.ACTION_STOP)
        self.expect_recovery(operator, feed)
        self.expect_whole_log(operator, orders)
        self.end(program)
        feed.end()

        self.assertEqual((feed.gaps, feed.undescribed), (0, 0))
        takes = sorted(set(self.daemon.takes.glob("*.mcap")) - before)
        told = sum(self.expect_right_or_told(path, feed, program, orders) for path in takes)
        failed = sum(each.code == control_pb2.CODE_FAILED for each in orders.answers)
        print(f"seed {seed}: {len(orders.answers)} orders, {failed} of them failed; {len(takes)} takes, {told} of them with a "
              f"fault in the log", flush=True)
        self.assertEqual(toml_faults(self.state), [])
        self.assertEqual([path.name for path in self.state.rglob("*.tmp")], [])

    def expect_recovery(self, operator, feed):
        self.done(operator.order("take", action=TAKE.ACTION_START))
        number = feed.newest.number
        until(lambda: feed.newest.number > number + 30, "30 more sets", LONG_S)
        self.done(operator.order("take", action=TAKE.ACTION_STOP))
        self.done(operator.order("mask", images=10))

    def expect_whole_log(self, operator, orders):
        def well():
            audit = operator.order("status").status.health.audit
            return not audit.error and audit.waiting == 0

        until(well, "the audit log is written again", LONG_S)
        lines = [json.loads(line) for line in self.daemon.log.read_text().splitlines()]
        begin = max(index for index, line in enumerate(lines) if line["what"] == "started")
        ordered = [line["order"] for line in lines[begin:] if line["what"] == "ordered"]
        expected = [each.name for each in orders.answers]
        self.assertEqual(ordered[:len(expected)], expected)
        self.assertEqual([line for line in lines if line["what"] == "lost"], [])

    def expect_right_or_told(self, path, feed, program, orders):
        """Returns whether the log tells a fault of the take."""
        take = read_take(path)
        snapshots = check_messages(path, take, feed)
        told = any(f"'{path}'" in line and " error " in line for line in program.output().splitlines())
        self.assertTrue(take.complete or told, f"{path.name} is cut off, and no line of the log tells it:\n{program.output()}")
        stop = next((each for each in orders.answers if f"'{path}' ended" in each.message), None)
        if stop and stop.code == control_pb2.CODE_DONE:
            self.assertTrue(take.complete, stop.message)
            # A take that is stopped before the next set is exposed is empty.
            last_ns = snapshots[-1].instants.exposed_at_ns if snapshots else self.start_of(path)
            self.assertGreaterEqual(last_ns, stop.asked_ns, f"{path.name} ends before its stop")
        return told

    def start_of(self, path):
        shown = self.desk.run("mocapctl", "take", "show", path, "--json")
        return int(json.loads(shown.stdout)["info"]["start_ns"])

    def test_a_start_with_failures_has_all_settings_or_names_the_file(self):
        """A file that cannot be read is taken neither for an empty one nor for its first half."""
        feed, program, operator = Subscriber(self.desk.endpoint), self.start(0), self.operator()
        self.assertTrue(self.first_snapshot(feed, program), program.output())
        self.done(operator.order("mask", images=10))
        wand = str(SOURCE / "config/markersets/rigid4.toml")
        self.done(operator.order("subject", action=SUBJECT.ACTION_ADD, name="wand", marker_set=wand))
        shots = [control_pb2.Shot(name=f"shot{number}") for number in range(50)]
        self.done(operator.order("shots", action=control_pb2.ShotsRequest.ACTION_IMPORT, shots=shots))
        self.end(program)
        feed.end()
        kept = {path: path.read_bytes() for path in self.state.iterdir() if path.suffix in (".toml", ".csv")}
        self.assertGreaterEqual(len(kept), 3)

        codes = [self.start_and_end(seed, kept) for seed in range(1, 10 * SEEDS + 1)]

        print(f"{len(codes)} starts with failures: {codes.count(0)} ran, {len(codes) - codes.count(0)} named a file", flush=True)
        self.assertIn(0, codes)

    def start_and_end(self, seed, kept):
        feed, program = Subscriber(self.desk.endpoint), self.start(seed, ENABLE_OFTEN)
        if self.first_snapshot(feed, program):
            self.fiu(program, DISABLE)
            self.assertEqual([each.name for each in feed.description.subjects], ["actor", "wand"], program.output())
            self.end(program)
        else:
            self.assertIn(program.process.poll(), (69, 78), f"seed {seed}: {program.output()}")
            self.assertIn(str(self.state), program.output())
        feed.end()
        changed = [path.name for path, content in kept.items() if path.read_bytes() != content]
        self.assertEqual(changed, [], f"seed {seed}: {program.output()}")
        return program.process.poll()


class OutOfMemory(CrashCycles):
    """The daemon is not killed: 5 % of its allocations fail. The hot path allocates nothing; other threads may end the daemon, as
    the service manager expects: it starts the daemon again."""
    early_kills = 0
    ended = collections.Counter()

    def start(self):
        preload = f"LD_PRELOAD={CONTROL} {CONTROL.parent}/fiu_posix_preload.so"
        return self.desk.start("/usr/bin/env", preload, f"FIU_CTRL_FIFO={self.desk.folder}/fiu", BIN / "mocapd", *self.daemon.arguments)

    def unexpected_gaps(self, _):
        """Those before the allocations fail: without memory the feed drops a message."""
        return self.gaps_with_memory

    def kill(self, program, feed):
        self.gaps_with_memory = feed.gaps
        # fiu-ctrl waits for an answer for ever if the daemon ends before it gives one.
        control = subprocess.Popen(["fiu-ctrl", "-f", self.desk.folder / "fiu", "-c", "enable_random name=libc/mm/*,probability=0.05",
                                    str(program.process.pid)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        try:
            code = program.wait(5)
        except subprocess.TimeoutExpired:
            super().kill(program, feed)
            code = "ran on"
        os.killpg(control.pid, signal.SIGKILL)
        control.wait()
        self.ended[code] += 1
        expect(code in ("ran on", -signal.SIGABRT, 69, 70), f"the daemon ended with {code}:\n{program.output()}")


class FailingMemory(unittest.TestCase):
    def test_a_daemon_without_memory_leaves_what_a_killed_one_leaves(self):
        with Desk() as desk:
            print(OutOfMemory(1, desk, kept_ms=UNDER_LOAD_MS).run(2 * SEEDS), flush=True)
        print(f"ends without memory: {dict(OutOfMemory.ended)}", flush=True)


if __name__ == "__main__":
    unittest.main(verbosity=2)
