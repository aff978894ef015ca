"""Kills a daemon that records and publishes, at random instants, and starts it again. After each kill: every take opens
and is what a subscriber saw, but for its last 100 ms; what was recorded before did not change; the audit log has each
answered order; the files of the state folder are whole; the feed comes back."""

import argparse
import collections
import dataclasses
import hashlib
import json
import os
import random
import signal
import sys
import time

from feed_client import Subscriber, control_pb2
from harness import Desk, until
from recording_daemon import OrderingThread, RecordingDaemon, Violation, check_messages, expect, toml_faults
from take_file import Damaged, read_take

LATEST_EARLY_KILL_S = 0.3
LATEST_KILL_S = 2.5

KEPT_MS = 100  # README of daemon/take: at most so much of a take is lost


@dataclasses.dataclass
class Totals:
    cycles: int = 0
    orders: collections.Counter = dataclasses.field(default_factory=collections.Counter)
    takes: int = 0
    cut_off: int = 0
    empty: int = 0
    snapshots: int = 0
    lost_ms: list = dataclasses.field(default_factory=list)
    back_s: list = dataclasses.field(default_factory=list)
    temporaries: int = 0

    def __str__(self):
        lost, back = sorted(self.lost_ms) or [0.0], sorted(self.back_s) or [0.0]
        orders = ", ".join(f"{count} {name}" for name, count in sorted(self.orders.items()))
        return (f"{self.cycles} kills; orders answered: {orders}\n"
                f"{self.takes} takes, {self.cut_off} of them cut off, {self.empty} empty; {self.snapshots} sets in them\n"
                f"missing at the end of a cut off take: {lost[len(lost) // 2]:.0f} ms in the median, {lost[-1]:.0f} ms at the most\n"
                f"first snapshot {back[len(back) // 2]:.2f} s after the start in the median, {back[-1]:.2f} s at the most\n"
                f"{self.temporaries} temporary files left")


class CrashCycles:
    early_kills = 0.1  # the share of kills while the daemon starts; the others come after the first take began

    def __init__(self, seed, desk, kept_ms=KEPT_MS):
        self.seed, self.desk, self.kept_ms, self.totals = seed, desk, kept_ms, Totals()
        self.daemon = RecordingDaemon(desk)
        self._log_read = 0
        self._finished = {}  # path of a take: the hash of its bytes

    def run(self, cycles, progress=lambda _: None):
        """Runs cycles until one violates an invariant; its exception names the cycle."""
        for number in range(1, cycles + 1):
            try:
                self.cycle(number)
            except (Damaged, AssertionError) as violated:
                raise Violation(f"seed {self.seed}, cycle {number}: {violated}") from violated
            self.totals.cycles = number
            progress(number)
        for path, digest in self._finished.items():
            expect(hash_of(path) == digest, f"seed {self.seed}: {path.name} was changed")
        self.totals.temporaries = len(list(self.daemon.state.rglob("*.tmp")))
        return self.totals

    def start(self):
        return self.desk.start("mocapd", *self.daemon.arguments)

    def kill(self, program, _):
        program.send(signal.SIGKILL)
        program.wait(30)

    def unexpected_gaps(self, feed):
        return feed.gaps

    def cycle(self, number):
        chance = random.Random(f"{self.seed}:{number}")
        feed, began = Subscriber(self.desk.endpoint), time.monotonic()
        program = self.start()
        orders = None
        if chance.random() < self.early_kills:
            time.sleep(chance.uniform(0, LATEST_EARLY_KILL_S))
        else:
            until(lambda: feed.newest is not None or program.process.poll() is not None, "the first snapshot")
            self.totals.back_s.append(time.monotonic() - began)
            orders = OrderingThread(feed, self.desk.endpoint, chance.random(), self.daemon.write_config)
            orders.recording.wait(60)
            time.sleep(chance.uniform(0, LATEST_KILL_S))
        ended = program.process.poll()
        self.kill(program, feed)
        if orders:
            orders.end(awaits_answer=False)
        feed.end()
        expect(ended is None, f"the daemon ended by itself with {ended}:\n{program.output()}")
        expect(not orders or orders.recording.is_set(), f"no take began:\n{program.output()}")
        self.check(feed, orders)
        program.end()
        program.log.unlink()

    # --- after a kill ---

    def check(self, feed, orders):
        done = [each for each in orders.answers if each.code == control_pb2.CODE_DONE] if orders else []
        expect(feed.undescribed == 0, f"{feed.undescribed} snapshots came before their description")
        gaps = self.unexpected_gaps(feed)
        expect(gaps == 0, f"{gaps} snapshots were lost between daemon and subscriber")
        self.totals.orders.update(each.name for each in done)
        self.check_audit(done)
        faults = toml_faults(self.daemon.state)
        expect(not faults, f"files of the state folder are not whole: {faults}")
        if any(each.name == "mask learn" for each in done):
            expect(list(self.daemon.state.glob("*mask*.toml")), "a mask was learnt, but its file is not there")
        self.check_takes(feed, done, *(orders.ending if orders else (None, None)))

    def check_takes(self, feed, done, ending, ending_ns):
        """`ending`: the order that would have ended the take, sent at `ending_ns`."""
        takes = set(self.daemon.takes.glob("*.mcap"))
        gone = [path.name for path in self._finished if path not in takes]
        expect(not gone, f"takes were removed: {gone}")
        begun = [each for each in done if each.name in ("take start", "take next")]
        cancelled = ending == "take cancel" or any(each.name == "take cancel" for each in done)
        for each in begun:
            expect(cancelled or any(str(path) in each.message for path in takes), f"'{each.message}', but there is no such file")
        for path in sorted(takes - self._finished.keys()):
            # The last one: the name of a cancelled take is used again.
            start = next((each for each in reversed(begun) if str(path) in each.message), None)
            stopped = any(each.name == "take stop" and str(path) in each.message for each in done)
            snapshots = self.check_take(path, feed, start, stopped)
            if start is not None and snapshots is not None:
                last_ns = snapshots[-1].instants.exposed_at_ns if snapshots else start.newest_ns
                self.check_loss(path, (ending_ns or feed.newest.instants.exposed_at_ns) - last_ns)

    def check_take(self, path, feed, start, stopped):
        """Returns the snapshots if the take is cut off. `start`: the answer to its start, if one came. `stopped`: its stop was answered."""
        take = read_take(path)
        self.totals.takes += 1
        expect(take.complete or not stopped, f"{path.name}: its stop was answered, but the file is cut off")
        if not take.messages:
            expect(start is None, f"{path.name}: its start was answered, but it is empty")
            self.check_empty_take(path)
            return None
        snapshots = check_messages(path, take, feed)
        self.totals.snapshots += len(snapshots)
        shown = self.desk.run("mocapctl", "take", "show", path, "--json")
        expect(shown.returncode == 0, f"{path.name} does not open: {shown.stderr}")
        if not take.complete:
            self.totals.cut_off += 1
            self.repair(path, take)
        verified = self.desk.run("mocapctl", "take", "verify", path)
        expect(verified.returncode == 0, f"{path.name}: {verified.stdout}{verified.stderr}")
        self._finished[path] = hash_of(path)
        return None if take.complete else snapshots

    def check_empty_take(self, path):
        """A kill while the file was made: before its metadata it is no take yet, and mocapctl says so."""
        shown = self.desk.run("mocapctl", "take", "show", path, "--json")
        expect(shown.returncode == 0 or "cut off" in shown.stderr or path.stat().st_size == 0, f"{path.name}: {shown.stderr}")
        self.totals.empty += 1
        path.unlink()

    def check_loss(self, path, lost_ns):
        lost_ms = max(0.0, lost_ns / 1e6)
        self.totals.lost_ms.append(lost_ms)
        expect(lost_ms <= self.kept_ms, f"{path.name}: the last {lost_ms:.0f} ms are missing, expected {self.kept_ms} at most; "
               f"load {os.getloadavg()[0]:.1f}")

    def repair(self, path, take):
        repaired = self.desk.run("mocapctl", "take", "repair", path)
        expect(repaired.returncode == 0, f"{path.name} is not repaired: {repaired.stderr}")
        now = read_take(path)
        expect(now.complete and now.messages == take.messages, f"{path.name}: the repair changed its messages")

    def check_audit(self, done):
        log = self.daemon.log
        if not log.exists():
            expect(not done, "orders were answered, but there is no audit log")
            return
        data = log.read_bytes()
        expect(len(data) >= self._log_read, "the audit log became shorter")
        new, self._log_read = data[self._log_read:], len(data)
        expect(data.endswith(b"\n"), f"the audit log ends within a line: {new[-200:]}")
        lines = [json.loads(line) for line in new.decode().splitlines()]
        expect(all(line["what"] not in ("lost", "skipped") for line in lines), "the audit log has a gap")
        logged = collections.Counter(line["order"] for line in lines if line["what"] == "ordered" and line["outcome"] == "done")
        missing = collections.Counter(each.name for each in done) - logged
        expect(not missing, f"answered orders are not in the audit log: {dict(missing)}")


def hash_of(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def main():
    parser = argparse.ArgumentParser(prog="crash_cycles.sh", description=__doc__)
    parser.add_argument("--cycles", type=int, default=100, help="number of kills (default 100)")
    parser.add_argument("--seed", type=int, default=1, help="of the instants and the orders (default 1)")
    parser.add_argument("--kept-ms", type=int, default=KEPT_MS, help=f"the most that may be missing of a take (default {KEPT_MS}); "
                        "the threads of a daemon on a busy machine wait for their turn")
    try:
        chosen = parser.parse_args()
    except SystemExit as ended:
        return 64 if ended.code else 0
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # ends the daemon, too
    began = time.monotonic()

    def progress(number):
        if number % 10 == 0:
            print(f"{number} of {chosen.cycles} cycles, {time.monotonic() - began:.0f} s", flush=True)

    with Desk() as desk:
        cycles = CrashCycles(chosen.seed, desk, chosen.kept_ms)
        try:
            print(cycles.run(chosen.cycles, progress))
        except Violation as violated:
            print(cycles.totals)
            print(f"crash_cycles: {violated}", file=sys.stderr)
            return 65
    return 0


if __name__ == "__main__":
    sys.exit(main())
