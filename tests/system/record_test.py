"""Recordings of a daemon: an existing file is kept at a restart, a reload goes on with it, the names are in the file, and a full disk
ends a recording after its last whole record while the feed continues. Runs in its own network namespace."""

import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import unittest

from harness import BIN, SOURCE, Desk, synthetic_volume, until

sys.path.insert(0, str(pathlib.Path(os.environ.get("MOCAP_BUILD_DIR", SOURCE / "build/release")) / "python"))
try:
    from mocap.v1 import snapshot_pb2
except ImportError as missing:
    print(f"skipped: {missing}; apt install python3-protobuf")
    sys.exit(77)


def delimited(data):
    """Returns the messages of bytes in which each message follows its length as a varint; all must be whole."""
    messages, at = [], 0
    while at < len(data):
        size = shift = 0
        while True:
            byte = data[at]
            size, shift, at = size | (byte & 127) << shift, shift + 7, at + 1
            if byte < 128:
                break
        assert at + size <= len(data), "the last message is incomplete"
        messages.append(data[at:at + size])
        at += size
    return messages


class Recorded(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        host, port = self.desk.endpoint.rsplit(":", 1)
        self.control = f"{host}:{int(port) + 1}"

    def config(self, snapshots, blobs=""):
        text = synthetic_volume(self.desk.endpoint) + f'\n[record]\nsnapshots = "{snapshots}"\nblobs = "{blobs}"\n'
        return self.desk.write("mocapd.toml", text)

    def status(self):
        asked = self.desk.run("mocapctl", "status", "--json", "--endpoint", self.control)
        return json.loads(asked.stdout)["status"] if asked.returncode == 0 else None

    def recordings(self):
        """Returns the recordings in health by file name, or nothing before the first report."""
        status = self.status()
        found = status["health"]["recordings"] if status and status.get("health") else []
        return {pathlib.Path(one["path"]).name: one for one in found}

    def wait_for_records(self, name, records):
        return until(lambda: (r := self.recordings().get(name)) and int(r["records"]) >= records and r,
                     f"{records} records in {name}")

    def end(self, daemon):
        daemon.send(signal.SIGTERM)
        self.assertEqual(daemon.wait(30), 0, daemon.output())

    def expect_whole_lines(self, text):
        """Expects whole snapshots in increasing order, with the names in the first; returns their number."""
        self.assertTrue(text.endswith("\n"))
        snapshots = [json.loads(line) for line in text.splitlines()]
        numbers = [int(snapshot.get("number", 0)) for snapshot in snapshots]
        self.assertEqual(numbers, sorted(set(numbers)))
        description = snapshots[0]["description"]
        self.assertEqual([camera["name"] for camera in description["cameras"]], [f"cam{n}" for n in range(1, 5)])
        self.assertEqual(description["subjects"][0]["name"], "actor")
        self.assertEqual(len(description["subjects"][0]["markers"]), 18)
        self.assertIn("Hips", [bone["name"] for bone in description["subjects"][0]["bones"]])
        versions = [snapshot["description"]["version"] for snapshot in snapshots if "description" in snapshot]
        self.assertEqual(len(versions), len(set(versions)))
        return len(snapshots)

    def logged_size(self, daemon, name):
        """Returns bytes and records that the log states for an ended recording."""
        found = re.search(rf"record: '{re.escape(str(self.desk.folder / name))}' ended, size=(\d+)B records=(\d+)", daemon.output())
        self.assertIsNotNone(found, daemon.output())
        return int(found[1]), int(found[2])

    def test_a_second_run_keeps_the_recording_of_the_first(self):
        config = self.config("take.jsonl", "take.blobs")
        first = self.desk.start("mocapd", "--config", config)
        self.wait_for_records("take.jsonl", 60)
        self.end(first)
        kept = {name: (self.desk.folder / name).read_bytes() for name in ("take.jsonl", "take.blobs")}

        second = self.desk.start("mocapd", "--config", config)
        self.wait_for_records("take-2.jsonl", 30)
        self.wait_for_records("take-2.blobs", 30)
        self.end(second)

        folder = self.desk.folder
        self.assertIn(f"writes to '{folder}/take-2.jsonl', because '{folder}/take.jsonl' exists", second.output())
        for name, content in kept.items():
            self.assertEqual((folder / name).read_bytes(), content, name)
        for daemon, name in ((first, "take.jsonl"), (second, "take-2.jsonl")):
            text = (self.desk.folder / name).read_text()
            self.assertEqual((len(text), self.expect_whole_lines(text)), self.logged_size(daemon, name))

    def test_a_reload_goes_on_with_a_recording_or_begins_another_one(self):
        daemon = self.desk.start("mocapd", "--config", self.config("take.pb"))
        for config in ("take.pb", "other.pb"):
            self.wait_for_records("take.pb", 30)
            self.config(config)
            self.assertEqual(self.desk.run("mocapctl", "reload", "--endpoint", self.control).returncode, 0)
        self.wait_for_records("other.pb", 30)
        self.end(daemon)

        self.assertEqual(sorted(path.name for path in self.desk.folder.glob("*.pb")), ["other.pb", "take.pb"])
        versions = []
        for name in ("take.pb", "other.pb"):
            data = (self.desk.folder / name).read_bytes()
            snapshots = [snapshot_pb2.Snapshot.FromString(message) for message in delimited(data)]
            self.assertEqual((len(data), len(snapshots)), self.logged_size(daemon, name))
            self.assertGreaterEqual(len(snapshots), 30)
            self.assertEqual(snapshots[0].description.subjects[0].name, "actor")
            self.assertFalse(snapshots[1].HasField("description"))
            described = [s.description.version for s in snapshots if s.HasField("description")]
            self.assertEqual(described, [s.description_version for s in snapshots if s.HasField("description")])
            versions += described
        self.assertEqual(versions, sorted(set(versions)))
        self.assertGreaterEqual(len(versions), 3)

    def test_a_full_disk_ends_the_recordings_once_and_the_feed_continues(self):
        (self.desk.folder / "full").mkdir()
        config = self.config("full/take.jsonl", "full/take.blobs")
        mount = "mount -t tmpfs -o size=1m none full"
        if subprocess.run(["unshare", "--mount", "sh", "-c", mount], cwd=self.desk.folder, capture_output=True).returncode == 0:
            command = ["unshare", "--mount", "sh", "-c", mount + ' && exec "$@"', "sh"]
        else:
            command = ["prlimit", "--fsize=1000000"]  # no right to mount: a limit for each file
        daemon = self.desk.start(f"/usr/bin/{command[0]}", *command[1:], BIN / "mocapd", "--config", config)
        disk = pathlib.Path(f"/proc/{daemon.process.pid}/root{self.desk.folder}/full")

        failed = until(lambda: (r := self.recordings()) and all(one["state"] == "RECORDING_STATE_FAILED" for one in r.values())
                       and r, "both recordings fail")
        sets = int(self.status()["health"]["sets"])
        until(lambda: int(self.status()["health"]["sentSnapshots"]) >= sets + 60, "the feed continues")
        shown = self.desk.run("mocapctl", "status", "--endpoint", self.control).stdout
        text = (disk / "take.jsonl").read_text()
        (self.desk.folder / "copy.blobs").write_bytes((disk / "take.blobs").read_bytes())
        (self.desk.folder / "copy.jsonl").write_text(text)
        self.end(daemon)

        self.assertEqual(sorted(failed), ["take.blobs", "take.jsonl"])
        self.assertEqual((len(text), self.expect_whole_lines(text)),
                         (int(failed["take.jsonl"]["sizeBytes"]), int(failed["take.jsonl"]["records"])))
        self.assertEqual((self.desk.folder / "copy.blobs").stat().st_size, int(failed["take.blobs"]["sizeBytes"]))
        self.assertRegex(shown, r"record +\S+/full/take\.jsonl +failed .* cannot be written: (No space left|File too large)")
        said = [line for line in daemon.output().splitlines() if "record: " in line and "cannot be written" in line]
        self.assertEqual(len(said), 2, daemon.output())
        self.assertTrue(all("the recording ends here, the feed continues" in line for line in said), said)
        self.assertNotIn("ended, size", daemon.output())
        scored = self.desk.run("mocap-score", "--truth", "copy.jsonl", "--stream", "copy.jsonl", "--json")
        self.assertEqual(scored.returncode, 0, scored.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
