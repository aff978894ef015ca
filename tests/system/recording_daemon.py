"""A daemon with a state folder that records and publishes, an operator who orders at random, and the checks of what they leave.
For crash_cycles.py and failing_files_test.py."""

import collections
import dataclasses
import difflib
import random
import threading
import tomllib

from feed_client import Operator, control_pb2, snapshot_pb2
from harness import LONG_QUEUES, SOURCE

CONFIG = """
[capture]
rig = "{source}/config/demo.rig.toml"
every_set = true

[publish]
endpoint = "{endpoint}"
every_snapshot = true
send_queue = 1000
velocities = true

[detect]
threshold = {threshold}

[takes]
min_free_mb = 1
before_s = 1

{queues}
[[subject]]
name = "actor"
marker_set = "{source}/config/markersets/openmocap18.toml"
keep = "bodies/actor.toml"
"""

CAMERA = """
[[camera]]
name = "cam{number}"
driver = "synthetic"
marker_set = "{source}/config/markersets/openmocap18.toml"
motion = "tpose:1,walk"
rate_hz = 60
"""

TAKE = control_pb2.TakeRequest
SUBJECT = control_pb2.SubjectRequest
# What an operator orders, with its weight. Most of the time a take is recorded.
ORDERS = {
    "take start": (6, "take", {"action": TAKE.ACTION_START}),
    "take stop": (2, "take", {"action": TAKE.ACTION_STOP}),
    "take next": (3, "take", {"action": TAKE.ACTION_NEXT}),
    "take cancel": (1, "take", {"action": TAKE.ACTION_CANCEL}),
    "take mark": (2, "take", {"action": TAKE.ACTION_MARK, "text": "mark"}),
    "mask learn": (2, "mask", {"images": 10}),
    "subject reset": (1, "subject", {"action": SUBJECT.ACTION_RESET, "name": "actor"}),
    "reload": (2, "reload", {}),
}
ENDS_A_TAKE = ("take stop", "take next", "take cancel")


class Violation(AssertionError):
    pass


def expect(holds, what):
    if not holds:
        raise Violation(what)


class RecordingDaemon:
    """Files and command line of the daemon."""

    def __init__(self, desk):
        self.desk = desk
        self.state = desk.folder / "state"
        self.state.mkdir()
        self.takes = self.state / "takes"
        self.log = self.state / "audit.jsonl"
        self.config = desk.folder / "mocapd.toml"
        self.arguments = ("--config", self.config, "--state", self.state)
        self.write_config(60)

    def write_config(self, threshold):
        text = CONFIG.format(source=SOURCE, endpoint=self.desk.endpoint, queues=LONG_QUEUES, threshold=threshold)
        text += "".join(CAMERA.format(source=SOURCE, number=number) for number in range(1, 5))
        self.desk.write("mocapd.part", text).rename(self.config)


@dataclasses.dataclass
class Answered:
    name: str
    code: int
    message: str
    asked_ns: int   # exposure of the newest snapshot when the order was sent
    newest_ns: int  # and when the answer came


class OrderingThread:
    """Orders at random. `answers` has the orders that were answered, `recording` is set with the first take. `ending`: the
    order that ends the take and was not answered, and its time as Answered.asked_ns."""

    def __init__(self, feed, endpoint, seed, write_config):
        self.answers, self.recording, self.ending = [], threading.Event(), (None, None)
        self._feed, self._write_config = feed, write_config
        self._stops, self._gives_up = threading.Event(), threading.Event()
        self._random = random.Random(seed)
        self._operator = Operator(endpoint)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        names, weights = list(ORDERS), [each[0] for each in ORDERS.values()]
        name = "take start"
        while not self._stops.is_set() and self._order(name):
            name = self._random.choices(names, weights)[0]
            self._stops.wait(self._random.uniform(0, 0.2))
        self._operator.end()

    def _order(self, name):
        _, part, values = ORDERS[name]
        if name == "reload":
            self._write_config(self._random.choice((60, 61, 62)))
        asked_ns = self._feed.newest.instants.exposed_at_ns
        self.ending = (name, asked_ns) if name in ENDS_A_TAKE else (None, None)
        answer = self._operator.order(part, until=self._gives_up.is_set, **values)
        if answer is None:
            return False
        self.ending = (None, None)
        self.answers.append(Answered(name, answer.code, answer.message, asked_ns, self._feed.newest.instants.exposed_at_ns))
        if name == "take start" and answer.code == control_pb2.CODE_DONE:
            self.recording.set()
        return True

    def end(self, awaits_answer=True):
        if not awaits_answer:
            self._gives_up.set()
        self._stops.set()
        self._thread.join()


def as_in_a_take(snapshot):
    """A snapshot of the feed or of a take, without what the sender or the recorder alone adds, and what each measures (UTC)."""
    for field in ("sequence", "synchronisation", "utc_minus_host_ns", "delivering_cameras"):
        snapshot.ClearField(field)
    snapshot.instants.ClearField("sent_at_ns")
    for subject in snapshot.subjects:
        subject.bones.ClearField("local_positions_m")
    return snapshot


def check_messages(path, take, feed):
    """Expects that a take has no gap, and the snapshots that the feed had. Returns its snapshots."""
    by_topic = collections.defaultdict(list)
    for message in take.messages:
        by_topic[message.topic].append(message)
    for topic, messages in by_topic.items():
        expect([each.sequence for each in messages] == list(range(len(messages))), f"{path.name}: {topic} has a gap")
    snapshots = [snapshot_pb2.Snapshot.FromString(each.data) for each in by_topic["snapshot"]]
    numbers = [each.number for each in snapshots]
    expect(not numbers or numbers == list(range(numbers[0], numbers[0] + len(numbers))), f"{path.name}: sets are missing")
    for snapshot in snapshots:
        if snapshot.number not in feed.snapshots:
            continue
        published = snapshot_pb2.Snapshot.FromString(feed.snapshots[snapshot.number])
        taken, sent = (str(as_in_a_take(each)).splitlines() for each in (snapshot, published))
        differences = "\n".join(difflib.unified_diff(sent, taken, "published", "in the take", n=0, lineterm=""))
        expect(not differences, f"{path.name}: set {snapshot.number} differs:\n{differences}")
    return snapshots


def toml_faults(folder):
    """The files in a folder that are no whole TOML files, with the reason."""
    faults = []
    for path in folder.rglob("*.toml"):
        try:
            if not tomllib.loads(path.read_text()):
                faults.append(f"{path.name}: is empty")
        except tomllib.TOMLDecodeError as fault:
            faults.append(f"{path.name}: {fault}")
    return faults
