"""Takes on a disk that is full, slow or read-only, and in a folder that is removed. The take ends with a whole file, the
operator gets one message, and the feed loses no set. Runs in its own network namespace; a test that needs the rights of root is
skipped without them."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

from harness import BIN, SOURCE, until
from takes import TakesTest

sys.path.insert(0, str(pathlib.Path(os.environ.get("MOCAP_BUILD_DIR", SOURCE / "build/release")) / "python"))
try:
    import zmq
    from mocap.v1 import event_pb2, snapshot_pb2
except ImportError as missing:
    print(f"skipped: {missing}; apt install python3-zmq python3-protobuf")
    sys.exit(77)

THROTTLE = pathlib.Path("/sys/fs/cgroup/blkio")


class Feed:
    """Snapshots and events of the feed since the object was made."""

    def __init__(self, test):
        context = zmq.Context()
        test.addCleanup(context.destroy, 0)
        self.socket = context.socket(zmq.SUB)
        self.socket.rcvhwm = 0
        for topic in (b"snapshot\0", b"event\0"):
            self.socket.subscribe(topic)
        self.socket.connect(test.desk.endpoint)
        self.numbers, self.failures = [], []

    def read(self):
        while self.socket.poll(0):
            topic, payload = self.socket.recv().split(b"\0", 1)
            if topic == b"snapshot":
                self.numbers.append(snapshot_pb2.Snapshot.FromString(payload).number)
            else:
                event = event_pb2.Event.FromString(payload)
                self.failures += [event.message] if event.kind == event_pb2.EVENT_KIND_TAKE_FAILED else []
        return self


class TakesOnBadDisks(TakesTest):
    def daemon_on(self, mount, more="", before=""):
        """Starts a daemon that alone sees what the shell command `mount` mounts at the folder `disk`."""
        (self.desk.folder / "disk").mkdir()
        tried = subprocess.run(["unshare", "--mount", "sh", "-c", mount], cwd=self.desk.folder, capture_output=True, text=True)
        if tried.returncode != 0:
            self.skipTest(f"no right to mount: {tried.stderr.strip()}")
        daemon = self.desk.start("/usr/bin/unshare", "--mount", "sh", "-c", f'{mount} && {before} exec "$@"', "sh",
                                 BIN / "mocapd", "--config", self.config(f'folder = "disk"\n{more}'))
        self.wait_for_sets(30)
        self.feed = Feed(self)
        until(lambda: self.feed.read().numbers, "a snapshot")
        return daemon

    def disk_of(self, daemon):
        return pathlib.Path(f"/proc/{daemon.process.pid}/root{self.desk.folder}/disk")

    def expect_one_message(self, daemon, reason):
        failed = self.wait_for_take("FAILED")
        self.assertRegex(failed["message"], reason)
        until(lambda: self.feed.read().failures, "the event")
        self.expect_no_loss()
        self.assertEqual(len(self.feed.read().failures), 1, self.feed.failures)
        self.assertRegex(self.feed.failures[0], reason)
        self.assertEqual(daemon.output().count("it ended early"), 1)

    def expect_no_loss(self):
        health = self.wait_for_sets(60)
        self.assertEqual([int(health[key]) for key in ("passedOverSets", "droppedSnapshots", "passedOverSnapshots")], [0] * 3)
        numbers = self.feed.read().numbers
        self.assertEqual(numbers, list(range(numbers[0], numbers[-1] + 1)))

    def expect_whole(self, path):
        shutil.copy(path, self.desk.folder / "copy.mcap")
        shown = self.show("copy.mcap")
        self.assertEqual(shown["state"], "complete")
        self.assertEqual(shown["quality"]["lost_sets"], 0)
        return shown

    def sets_in(self, path):
        """Of a take that is being recorded."""
        shown = self.desk.run("mocapctl", "take", "show", path, "--json")
        return json.loads(shown.stdout)["quality"]["sets"] if shown.returncode == 0 else 0

    def test_a_full_disk(self):
        daemon = self.daemon_on("mount -t tmpfs -o size=3m none disk")
        self.take("start")

        self.expect_one_message(daemon, "min_free_mb|No space left")
        self.expect_whole(self.disk_of(daemon) / "take_001.mcap")

    def test_a_disk_that_becomes_slow(self):
        group = THROTTLE / f"mocap-test-{os.getpid()}"
        if not (THROTTLE / "blkio.throttle.write_bps_device").exists():
            self.skipTest(f"{THROTTLE} cannot throttle a disk: no cgroup of version 1")
        try:
            group.mkdir()
        except OSError as refused:
            self.skipTest(f"no right to throttle a disk: {refused}")
        self.addCleanup(group.rmdir)
        self.addCleanup(self.desk.close)  # first, because the group must be empty
        (self.desk.folder / "disk.img").touch()
        os.truncate(self.desk.folder / "disk.img", 64_000_000)
        subprocess.run(["mkfs.ext4", "-q", "-F", "disk.img"], cwd=self.desk.folder, check=True)
        daemon = self.daemon_on("mount -o loop disk.img disk", "memory_mb = 8", f"echo $$ > {group}/cgroup.procs &&")
        device = os.stat(self.disk_of(daemon)).st_dev

        def throttle(bytes_per_s):
            limit = f"{os.major(device)}:{os.minor(device)} {bytes_per_s}"
            (group / "blkio.throttle.write_bps_device").write_text(limit)

        throttle(1_000_000)
        self.take("start", "slow")
        self.wait_for_recorded(120)
        self.take("stop")
        self.expect_whole(self.disk_of(daemon) / "slow.mcap")
        self.take("start", "too_slow")
        until(lambda: self.sets_in(self.disk_of(daemon) / "too_slow.mcap") >= 60, "60 sets are in the file")
        throttle(10_000)

        self.expect_one_message(daemon, "the disk is too slow: 8 MB wait to be written")
        self.assertGreaterEqual(self.expect_whole(self.disk_of(daemon) / "too_slow.mcap")["quality"]["sets"], 60)

    def test_a_disk_that_cannot_be_written(self):
        daemon = self.daemon_on("mount -t tmpfs -o ro,size=64m none disk")
        refused = self.ctl("take", "start")

        self.assertEqual(refused.returncode, 69, refused.stdout + refused.stderr)
        self.assertRegex(refused.stderr, "disk/take_001.mcap.*Read-only file system")
        self.assertEqual(daemon.output().count("Read-only file system"), 1)
        self.expect_no_loss()
        remount = ["nsenter", "--target", str(daemon.process.pid), "--mount", "mount", "-o", "remount,rw", self.desk.folder / "disk"]
        subprocess.run(remount, check=True)
        self.take("start")
        self.wait_for_recorded(30)
        self.take("stop")
        self.expect_whole(self.disk_of(daemon) / "take_001.mcap")

    def test_a_folder_that_is_removed(self):
        daemon = self.daemon_on("true")
        self.take("start")
        self.wait_for_recorded(30)
        file = next(pathlib.Path(f"/proc/{daemon.process.pid}/fd/{number}") for number in os.listdir(f"/proc/{daemon.process.pid}/fd")
                    if "take_001.mcap" in os.readlink(f"/proc/{daemon.process.pid}/fd/{number}"))
        with open(file, "rb") as removed:
            shutil.rmtree(self.desk.folder / "disk")
            self.expect_one_message(daemon, "is gone .*its folder or its file was removed")
            (self.desk.folder / "removed.mcap").write_bytes(removed.read())
        self.expect_whole(self.desk.folder / "removed.mcap")
        self.take("start")
        self.wait_for_recorded(30)
        self.take("stop")
        self.expect_whole(self.desk.folder / "disk/take_001.mcap")


if __name__ == "__main__":
    unittest.main(verbosity=2)
