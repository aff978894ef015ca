"""Runs a studio of real programs for minutes or hours, with a fault a minute, and judges it: see README.md."""

import argparse
import dataclasses
import pathlib
import random
import signal
import sys
import tempfile
import time

import faults
import report
from studio import DONE, TAKE, Studio
from watchers import Page, Receiver, Subscribers

RECOVERY_S = 60      # the longest time from the end of a fault until all is well
WELL_S = 3           # all is well for so long: the fault is over
SETTLED_S = 60       # memory counts from here: buffers are full, all code has run
GROWTH_MB = 16       # the most that a program may grow then, until its end
LOST_SHARE = 0.01    # of the images, without a fault: the simulated cameras share the machine
STALLING = 5


@dataclasses.dataclass
class Fault:
    name: str
    began_s: float
    ended_s: float = None
    recovered_s: float = None


@dataclasses.dataclass
class Life:
    """The memory of one process of a program."""
    name: str
    began: float
    settled_mb: float = None
    most_mb: float = 0.0
    points: list = dataclasses.field(default_factory=list)

    def add(self, age_s, own_mb):
        if age_s < SETTLED_S:
            return
        if self.settled_mb is None:
            self.settled_mb = own_mb
        self.most_mb = max(self.most_mb, own_mb)
        self.points.append((age_s, own_mb))

    def growth_an_hour(self):
        """The slope of a straight line through the second half of a life of five minutes or more."""
        late = self.points[len(self.points) // 2:]
        if not late or late[-1][0] < 300:
            return None
        mean_s, mean_mb = (sum(values) / len(late) for values in zip(*late))
        spread = sum((at - mean_s) ** 2 for at, _ in late)
        return 3600 * sum((at - mean_s) * (mb - mean_mb) for at, mb in late) / spread if spread else None


@dataclasses.dataclass
class Takes:
    path: pathlib.Path = None  # of the take that is recorded
    whole: int = 0
    repaired: int = 0
    told: int = 0


class Soak:
    def __init__(self, folder, chosen):
        self.seed, self.chance = chosen.seed, random.Random(chosen.seed)
        self.studio = Studio(folder, chosen.cameras, chosen.rate)
        self.studio.start_all()
        self.steady = Subscribers(self.studio.endpoint, chosen.subscribers)
        self.stalling = Subscribers(self.studio.endpoint, STALLING)
        self.page, self.receiver = Page(self.studio.page_port), Receiver(self.studio.bridge_port)
        self.faults, self.samples, self.violations, self.lives, self.takes = [], [], [], [], Takes()
        self.began, self._before, self._well_since, self._health = time.monotonic(), None, None, None
        self._kinds = faults.in_turn(self.chance)

    def now_s(self):
        return time.monotonic() - self.began

    def violate(self, what):
        self.violations.append(f"{self.now_s():.0f} s: {what}")
        print(f"soak: VIOLATED {self.violations[-1]}", flush=True)

    def is_explained(self, at_s):
        """Whether a loss at this time is explained by a fault, or by the start."""
        first = self.faults[0].began_s if self.faults else at_s
        starting = at_s < first and at_s < RECOVERY_S
        return starting or any(each.began_s - 1 <= at_s <= (each.recovered_s or at_s) + 2 for each in self.faults)

    # --- once a second ---

    def sample(self):
        line, health = dict(self.steady.line), self.studio.health()
        counts = {"received": line["received"], "missed": line["missed"], "drawn": self.page.drawn, "packets": self.receiver.packets}
        before = self._before or counts
        row = {name: counts[name] - before[name] for name in counts} | {name: line[name] for name in ("p50_ms", "p99_ms")}
        self._before = counts
        row["missing_images"] = self.newly_missing(health)
        for name in ("mocapd", "page", "bridge"):
            row[name] = self.studio.own_mb(name)
            self.follow_life(name, row[name])
        self.samples.append((self.now_s(), row))
        self.judge(row, line)

    def newly_missing(self, health):
        if health is None:
            self._health = None
            return 0
        total = sum(each.missing_frames + each.failed_frames for each in health.cameras)
        before, self._health = self._health, total
        return max(0, total - before) if before is not None else 0

    def follow_life(self, name, own_mb):
        began = self.studio.began[name]
        if not any(life.name == name and life.began == began for life in self.lives):
            self.lives.append(Life(name, began))
        if own_mb is not None:
            next(life for life in reversed(self.lives) if life.name == name).add(time.monotonic() - began, own_mb)

    def judge(self, row, line):
        well = (row["received"] >= 0.8 * self.studio.rate_hz * self.steady.count and row["drawn"] > 0 and row["packets"] > 0 and
                line["cameras"] == self.studio.cameras and line["tracking"])
        self._well_since = (self._well_since or self.now_s()) if well else None
        if row["missed"] and not self.is_explained(self.now_s()):
            self.violate(f"subscribers missed {row['missed']} snapshots without a fault")
        for name in self.studio.ended():
            code = self.studio.programs[name].returncode
            self.violate(f"{name} ended by itself with {code}; its log is {self.studio.folder}/{name}.log")
            self.studio.start(name)

    def state(self):
        row, line = self.samples[-1][1], self.steady.line
        return (f"{row['received']} snapshots a second, {row['drawn']} drawn, {row['packets']} packets, {line['cameras']} cameras, "
                f"tracking {line['tracking']}")

    def is_well(self):
        return self._well_since is not None and self.now_s() - self._well_since >= WELL_S

    def run_for(self, seconds, until=lambda: False):
        """Samples for a time. Returns whether `until` held."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            began = time.monotonic()
            self.sample()
            if until():
                return True
            time.sleep(max(0.0, min(1 - (time.monotonic() - began), end - time.monotonic())))
        return until()

    # --- once a minute ---

    def round(self, seconds):
        """A take in which a fault happens, and its end."""
        began = time.monotonic()
        self.start_take()
        self.run_for(self.chance.uniform(3, max(4, seconds / 4)))
        kind = next(self._kinds)
        fault = Fault(kind.__name__, self.now_s())
        self.faults.append(fault)
        print(f"soak: {fault.began_s:.0f} s: {fault.name}", flush=True)
        self._well_since = None
        for pause_s in kind(self.studio, self.chance, self.stalling):
            self.run_for(pause_s)
        fault.ended_s = self.now_s()
        self._well_since = None
        if self.run_for(RECOVERY_S, self.is_well):
            fault.recovered_s = self._well_since
        else:
            self.violate(f"not well {RECOVERY_S} s after {fault.name}: {self.state()}")
            fault.recovered_s = self.now_s()
        self.run_for(max(1, seconds - (time.monotonic() - began)))
        self.end_take(fault)

    def start_take(self):
        code, message = self.studio.take(TAKE.ACTION_START)
        path = self.studio.disk / message.split("'")[1] if code == DONE else None
        if code != DONE:
            self.violate(f"a take was not started: {message}")
        self.takes.path = path

    def end_take(self, fault):
        if self.takes.path is None:
            return
        code, message = self.studio.take(TAKE.ACTION_STOP)
        shown = self.studio.check_take(self.takes.path)
        if code == DONE and shown == "whole":
            self.takes.whole += 1
        elif code != DONE and fault.name == "disk_full" and shown == "whole":
            self.takes.told += 1
        elif fault.name == "daemon_killed" and shown == "repaired":
            self.takes.repaired += 1
        else:
            self.violate(f"take {self.takes.path.name} is {shown} after {fault.name}; the answer to its stop: {message}")
        self.takes.path.unlink(missing_ok=True)

    # --- the whole ---

    def run(self, seconds, every_s):
        if not self.run_for(RECOVERY_S, self.is_well):
            self.violate(f"not well {RECOVERY_S} s after the start: {self.state()}")
            return
        while self.now_s() < seconds:
            self.round(every_s)
            print(f"soak: {self.now_s():.0f} of {seconds:.0f} s, {len(self.faults)} faults, {len(self.violations)} violations, "
                  f"daemon {self.samples[-1][1]['mocapd'] or 0:.0f} MB", flush=True)
        self.judge_all()

    def judge_all(self):
        for life in self.lives:
            if life.settled_mb is not None and life.most_mb - life.settled_mb > GROWTH_MB:
                self.violate(f"{life.name} grew from {life.settled_mb:.0f} to {life.most_mb:.0f} MB, expected {GROWTH_MB} MB at most")
        calm = [row for at, row in self.samples if not self.is_explained(at)]
        images, lost = len(calm) * self.studio.rate_hz * self.studio.cameras, sum(row["missing_images"] for row in calm)
        if lost > LOST_SHARE * images:
            self.violate(f"{lost} of {images:.0f} images were lost without a fault, expected {100 * LOST_SHARE:.0f} % at most")

    def end(self):
        self.steady.end()
        self.stalling.end()
        self.studio.end()


def main():
    parser = argparse.ArgumentParser(prog="soak.sh", description=__doc__)
    duration = parser.add_mutually_exclusive_group(required=True)
    duration.add_argument("--minutes", type=float)
    duration.add_argument("--hours", type=float)
    parser.add_argument("--seed", type=int, default=1, help="of the faults (default 1)")
    parser.add_argument("--cameras", type=int, default=4, choices=range(2, 9), help="default 4")
    parser.add_argument("--rate", type=int, default=30, help="images a second of each camera (default 30)")
    parser.add_argument("--subscribers", type=int, default=20, help="default 20, and 5 that stall")
    parser.add_argument("--every", type=float, default=60, help="seconds from fault to fault (default 60)")
    parser.add_argument("--report", type=pathlib.Path, default=pathlib.Path("build/soak"), help="folder (default build/soak)")
    try:
        chosen = parser.parse_args()
    except SystemExit as ended:
        return 64 if ended.code else 0
    seconds = chosen.minutes * 60 if chosen.minutes is not None else chosen.hours * 3600
    chosen.report.mkdir(parents=True, exist_ok=True)
    for number in (signal.SIGTERM, signal.SIGINT):  # ends the programs and writes the report, also in the background
        signal.signal(number, lambda *_: sys.exit(143))
    with tempfile.TemporaryDirectory(prefix="mocap-soak-") as folder:
        soak = Soak(pathlib.Path(folder), chosen)
        try:
            soak.run(seconds, chosen.every)
        finally:
            soak.end()
            print(report.write(chosen.report, soak))
            for log in pathlib.Path(folder).glob("*.log"):
                (chosen.report / log.name).write_bytes(log.read_bytes())
    return 65 if soak.violations else 0


if __name__ == "__main__":
    sys.exit(main())
