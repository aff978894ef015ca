"""Many takes tracked again: by processes of this machine, GNU parallel, Slurm, and as an Open Job Description. Runs in its
own network namespace."""

import contextlib
import copy
import json
import os
import pathlib
import pty
import shutil
import signal
import subprocess
import unittest

import openjd_template
import slurm
from harness import BIN, Desk, synthetic_volume, until

NAMES = ("a", "b", "c")


class RetrackFarm(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.desk = Desk()
        cls.addClassCleanup(cls.desk.close)
        host, port = cls.desk.endpoint.rsplit(":", 1)
        control = f"{host}:{int(port) + 1}"
        daemon = cls.desk.start("mocapd", "--config", cls.desk.write(
            "mocapd.toml", synthetic_volume(cls.desk.endpoint) + "\n[takes]\nmin_free_mb = 1\n"))

        def ctl(*arguments):
            return cls.desk.run("mocapctl", *arguments, "--endpoint", control)

        def recorded():
            asked = ctl("status", "--json")
            status = json.loads(asked.stdout)["status"] if asked.returncode == 0 else {}
            return int(((status.get("health") or {}).get("take") or {}).get("sets", 0))

        until(lambda: ctl("take", "start", "recorded", "--before", "30").returncode == 0, "the take begins")
        until(lambda: recorded() >= 400, "400 sets are recorded")
        ctl("take", "stop")
        daemon.end()
        cls.takes = cls.desk.folder / "several takes"
        cls.takes.mkdir()
        for name in NAMES:
            shutil.copy(cls.desk.folder / "takes/recorded.mcap", cls.takes / f"{name}.mcap")
        cls.desk.write("broken.mcap", "no take")
        cls.one_process = cls.desk.folder / "one process"  # the new takes as one process after the other makes them
        cls.one_process.mkdir()
        for name in NAMES:
            done = cls.retrack(cls.takes / f"{name}.mcap", "--out", cls.one_process / f"{name}.mcap")
            assert done.returncode == 0, done.stderr

    @classmethod
    def retrack(cls, *arguments, environment=None):
        return subprocess.run([BIN / "mocapctl", "take", "retrack", *map(str, arguments)], cwd=cls.desk.folder,
                              env=environment, capture_output=True, text=True, timeout=600)

    def out(self, name):
        return self.desk.folder / f"{self._testMethodName} {name}"

    def begin(self, *arguments, environment=None):
        """Starts a command that the test interrupts. A group of its own, as a shell in a terminal makes it."""
        process = subprocess.Popen([BIN / "mocapctl", "take", "retrack", *map(str, arguments)], cwd=self.desk.folder,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment,
                                   start_new_session=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def expect_results(self, folder, names=NAMES):
        for name in names:
            self.assertEqual((folder / f"{name}.mcap").read_bytes(), (self.one_process / f"{name}.mcap").read_bytes(), name)
        self.assertEqual([file.name for file in folder.glob(".*.part.mcap")], [])

    def test_several_takes_are_tracked_by_several_processes(self):
        out = self.out("new")
        done = self.retrack(self.takes, "broken.mcap", "--out-dir", out, "--jobs", 2)

        self.expect_results(out)
        self.assertEqual(done.returncode, 65, "that of the take that failed")
        self.assertEqual(done.stdout.count("snapshots are those of the recording"), 3, done.stdout)
        self.assertIn("3 tracked, 1 failed", done.stdout)
        self.assertIn("broken.mcap", done.stderr)
        self.assertFalse((out / "broken.mcap").exists())

    def test_a_terminal_shows_the_progress_of_all_takes_on_one_line(self):
        terminal, stderr = pty.openpty()
        self.addCleanup(os.close, terminal)
        command = subprocess.Popen([BIN / "mocapctl", "take", "retrack", self.takes, "--out-dir", self.out("new")],
                                   cwd=self.desk.folder, stdout=subprocess.DEVNULL, stderr=stderr)
        os.close(stderr)
        shown = b""
        with contextlib.suppress(OSError):  # the end of a terminal
            while read := os.read(terminal, 4096):
                shown += read

        self.assertEqual(command.wait(), 0)
        self.assertRegex(shown, rb"tracked \d+ %, [0-3] of 3 takes done")
        self.assertNotIn(b"\n", shown)

    def test_json_has_one_line_for_each_take(self):
        done = self.retrack(self.takes, "broken.mcap", "--out-dir", self.out("new"), "--json")

        reports = {pathlib.Path(report["take"]).stem: report for report in map(json.loads, done.stdout.splitlines())}
        self.assertEqual(set(reports), {*NAMES, "broken"})
        self.assertEqual(reports["a"]["equal_sets"], reports["a"]["recorded_sets"])
        self.assertEqual(reports["broken"]["exit_code"], 65)

    def test_resume_skips_what_is_whole_and_made_of_the_same(self):
        out = self.out("new")
        out.mkdir()
        shutil.copy(self.one_process / "a.mcap", out)
        (out / "b.mcap").write_bytes((self.one_process / "b.mcap").read_bytes()[:5000])  # cut off

        done = self.retrack(self.takes, "--out-dir", out, "--resume")
        again = self.retrack(self.takes / "a.mcap", self.takes / "c.mcap", "--out-dir", out, "--resume")
        shorter = self.retrack(self.takes / "a.mcap", "--out-dir", out, "--resume", "--range", 1, 2)
        refused = self.retrack(self.takes / "a.mcap", "--out-dir", out)

        self.assertEqual(done.returncode, 65)
        self.assertIn("1 tracked, 1 there already, 1 failed", done.stdout)
        self.assertIn("b.mcap", done.stderr)
        self.assertEqual((out / "b.mcap").stat().st_size, 5000, "no file is replaced")
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertEqual(again.stdout.count("not tracked again"), 2)
        self.assertEqual(shorter.returncode, 65)
        self.assertIn("with other settings", shorter.stderr)
        self.assertEqual(refused.returncode, 65)
        self.assertIn("exists", refused.stderr)
        self.expect_results(out, ("a", "c"))

    def test_options_reach_each_process(self):
        out = self.out("new")
        done = self.retrack("several takes/a.mcap", "several takes/b.mcap", "--out-dir", out, "--range", 2, 4, "--json")

        self.assertEqual(done.returncode, 0, done.stderr)
        for name in ("a", "b"):
            shown = json.loads(self.desk.run("mocapctl", "take", "show", out / f"{name}.mcap", "--json").stdout)
            self.assertAlmostEqual(shown["seconds"], 2.0, delta=0.1)

    def test_a_killed_worker_is_started_again(self):
        """If the worker ends before it can be killed, the test tries once more."""
        for attempt in range(20):
            out = self.out(attempt)
            command = self.begin(self.takes, "--out-dir", out, "--jobs", 1, "--preset", "offline")
            worker = until(lambda: self.child_of(command), "a worker runs")
            part = until(lambda: list(out.glob(".*.part.mcap")) or command.poll() is not None, "the new take is being written")
            killed = self.kill(worker) and part is not True and part[0].exists()
            output = command.stdout.read()
            self.assertEqual(command.wait(), 0, output)
            self.assertEqual(list(out.glob(".*.part.mcap")), [])
            if killed:
                break
        self.assertTrue(killed, "no worker was killed while it wrote")
        expected = self.out("expected")
        self.assertEqual(self.retrack(self.takes, "--out-dir", expected, "--preset", "offline").returncode, 0)
        for name in NAMES:
            self.assertEqual((out / f"{name}.mcap").read_bytes(), (expected / f"{name}.mcap").read_bytes(), name)

    @staticmethod
    def child_of(process):
        children = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        return int(children[0]) if children else None

    @staticmethod
    def kill(process_id):
        try:
            os.kill(process_id, signal.SIGKILL)
        except ProcessLookupError:
            return False
        return True

    def test_ctrl_c_ends_the_workers_and_leaves_no_half_take(self):
        out = self.out("new")
        command = self.begin(self.takes, "--out-dir", out, "--jobs", 2, "--preset", "offline")
        workers = until(lambda: pathlib.Path(f"/proc/{command.pid}/task/{command.pid}/children").read_text().split(), "workers run")
        os.killpg(command.pid, signal.SIGINT)  # as the terminal does
        output = command.stdout.read()

        self.assertEqual(command.wait(), -signal.SIGINT, output)
        self.assertIn("the same command with --resume goes on", output)
        for worker in workers:
            self.assertFalse(pathlib.Path(f"/proc/{worker}").exists())
        self.assertEqual(list(out.glob(".*")), [])
        resumed = self.retrack(self.takes, "--out-dir", out, "--preset", "offline", "--resume")
        self.assertEqual(resumed.returncode, 0, resumed.stderr)
        self.assertEqual(len(list(out.glob("*.mcap"))), 3)

    CHUNKS = ("--chunks", 3, "--overlap", 2)

    def expect_chunks_of(self, take, out):
        """The joined take is that of one process, and no chunk is left."""
        one_after_the_other = self.out("expected") / f"{take}.mcap"
        one_after_the_other.parent.mkdir(exist_ok=True)
        if not one_after_the_other.exists():
            for chunk in ("2/3", "3/3", "1/3"):
                done = self.retrack(self.takes / f"{take}.mcap", "--out", one_after_the_other, "--chunk", chunk, "--overlap", 2)
                self.assertEqual(done.returncode, 0, done.stderr)
            joined = self.desk.run("mocapctl", "take", "join", one_after_the_other, "--json")
            self.assertEqual(joined.returncode, 0, joined.stderr)
            self.assertEqual([seam["agrees"] for seam in json.loads(joined.stdout)["seams"]], [True, True])
            verified = self.desk.run("mocapctl", "take", "verify", one_after_the_other)
            self.assertEqual(verified.returncode, 0, verified.stdout)
        self.assertEqual((out / f"{take}.mcap").read_bytes(), one_after_the_other.read_bytes())
        self.assertEqual(list(out.glob("*.chunks")), [])

    def test_chunks_of_several_processes_are_those_of_one(self):
        out = self.out("new")
        done = self.retrack(self.takes / "a.mcap", self.takes / "b.mcap", "--out-dir", out, "--jobs", 2, *self.CHUNKS, "--json")
        resumed = self.retrack(self.takes / "a.mcap", "--out-dir", out, *self.CHUNKS, "--resume")
        alone = self.out("alone")
        alone.mkdir()
        single = self.retrack(self.takes / "a.mcap", "--out", alone / "a.mcap", *self.CHUNKS)

        self.assertEqual(done.returncode, 0, done.stderr)
        reports = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertEqual(sorted(report["chunk"] for report in reports if "chunk" in report), 2 * ["1/3"] + 2 * ["2/3"] + 2 * ["3/3"])
        self.assertEqual(len([report for report in reports if "seams" in report]), 2)
        self.expect_chunks_of("a", out)
        self.expect_chunks_of("b", out)
        self.assertEqual(resumed.returncode, 0, resumed.stderr)
        self.assertIn("not joined again", resumed.stdout)
        self.assertEqual(single.returncode, 0, single.stderr)
        self.expect_chunks_of("a", alone)

    def test_a_killed_worker_tracks_its_chunk_again(self):
        out = self.out("new")
        marker = self.out("once")
        program = self.desk.write("killed-in-a-chunk.sh", f'#!/bin/sh\nmkdir "{marker}" && kill -9 $$\nexec "{BIN}/mocapctl" "$@"\n')
        program.chmod(0o755)
        dry = self.retrack(self.takes / "a.mcap", "--out-dir", out, "--farm", "parallel", *self.CHUNKS, "--dry-run")
        script = out / "farm/unit.sh"
        script.write_text(script.read_text().replace(f"'{BIN}/mocapctl'", f"'{program}'"))
        codes = [subprocess.run(["bash", script, str(unit)], timeout=300).returncode for unit in range(3)]
        joined = self.desk.run("mocapctl", "take", "join", out / "a.mcap", "--remove-chunks")

        self.assertEqual(dry.returncode, 0, dry.stderr)
        self.assertTrue(marker.exists(), "a worker was killed")
        self.assertEqual(codes, [0, 0, 0])
        self.assertEqual(joined.returncode, 0, joined.stderr)
        self.expect_chunks_of("a", out)

    def test_chunks_of_another_number_are_left_alone(self):
        out = self.out("new")
        earlier = self.retrack(self.takes / "a.mcap", "--out", out / "a.mcap", "--chunk", "1/2")
        done = self.retrack(self.takes / "a.mcap", "--out-dir", out, *self.CHUNKS)
        resumed = self.retrack(self.takes / "a.mcap", "--out-dir", out, *self.CHUNKS, "--resume")
        left = [file.name for file in (out / "a.chunks").iterdir()]
        (out / "a.chunks/1-of-2.mcap").rename(out / "1-of-2.mcap")
        none_left = self.desk.run("mocapctl", "take", "join", out / "a.mcap", "--from", out / "a.chunks", "--resume")
        (out / "a.chunks").rmdir()

        self.assertEqual(earlier.returncode, 0, earlier.stderr)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(resumed.returncode, 0, resumed.stderr)
        self.assertEqual(resumed.stdout.count(f"{out}/a.mcap: is there"), 4, resumed.stdout)
        self.assertEqual(left, ["1-of-2.mcap"])
        self.assertEqual(none_left.returncode, 66)
        self.assertIn("has no chunks", none_left.stderr)
        self.expect_chunks_of("a", out)

    def test_a_failed_chunk_leaves_the_take_to_be_joined_later(self):
        out = self.out("new")
        (out / "a.chunks").mkdir(parents=True)
        (out / "a.chunks/2-of-3.mcap").write_text("no take")
        failed = self.retrack(self.takes / "a.mcap", "--out-dir", out, *self.CHUNKS)
        left = {file.name for file in (out / "a.chunks").iterdir()}
        (out / "a.chunks/2-of-3.mcap").unlink()
        resumed = self.retrack(self.takes / "a.mcap", "--out-dir", out, *self.CHUNKS, "--resume")

        self.assertEqual(failed.returncode, 65)
        self.assertIn("chunk 2/3: ", failed.stderr)
        self.assertIn("not joined, as a chunk failed", failed.stderr)
        self.assertEqual(left, {"1-of-3.mcap", "2-of-3.mcap", "3-of-3.mcap"})
        self.assertEqual(resumed.returncode, 0, resumed.stderr)
        self.assertEqual(resumed.stdout.count("not tracked again"), 2)
        self.expect_chunks_of("a", out)

    def test_wrong_combinations_are_refused(self):
        both = self.retrack(self.takes, "--out", "new.mcap")
        no_folder = self.retrack(self.takes, "--farm", "parallel")
        two = self.retrack(self.takes / "a.mcap", self.one_process / "a.mcap", "--out-dir", self.out("new"))

        chunk = self.retrack(self.takes / "a.mcap", "--chunk", "4/3")
        farm = self.retrack(self.takes / "a.mcap", "--chunk", "1/3", "--jobs", 2)
        ranged = self.retrack(self.takes / "a.mcap", "--chunks", 3, "--range", 1, 2)

        self.assertEqual((both.returncode, no_folder.returncode, two.returncode), (64, 64, 64))
        self.assertEqual((chunk.returncode, farm.returncode, ranged.returncode), (64, 64, 64))
        self.assertIn("expected NUMBER/ALL", chunk.stderr)
        self.assertIn("expected --chunks N", farm.stderr)
        self.assertIn("--range", ranged.stderr)
        self.assertIn("--out-dir", both.stderr)
        self.assertIn("--out-dir", no_folder.stderr)
        self.assertIn("would both become", two.stderr)

    def test_a_farm_whose_program_is_missing_names_the_package(self):
        nothing = {"PATH": str(self.desk.folder)}
        for farm, package in (("slurm", "slurm-client"), ("parallel", "parallel")):
            done = self.retrack(self.takes, "--out-dir", self.out(farm), "--farm", farm, environment=nothing)
            self.assertEqual(done.returncode, 69)
            self.assertEqual(len(done.stderr.splitlines()), 1)
            self.assertIn(f"Debian package {package}", done.stderr)

    def test_a_dry_run_writes_the_scripts_alone(self):
        for farm in ("slurm", "parallel"):
            out = self.out(farm)
            done = self.retrack(self.takes, "--out-dir", out, "--farm", farm, "--jobs", 5, "--dry-run")
            self.assertEqual(done.returncode, 0, done.stderr)
            scripts = [out / "farm/unit.sh"] + ([out / "farm/array.sbatch"] if farm == "slurm" else [])
            for script in scripts:
                self.assertIn(f"{script}: written", done.stdout)
                self.assertEqual(subprocess.run(["bash", "-n", script]).returncode, 0)
            self.assertEqual(list(out.glob("*.mcap")), [])
        self.assertIn("#SBATCH --array=0-2%5", (self.out("slurm") / "farm/array.sbatch").read_text())

    @unittest.skipUnless(shutil.which("parallel"), "GNU parallel is not installed (Debian package parallel)")
    def test_gnu_parallel_runs_the_takes(self):
        out = self.out("new")
        command = (self.takes, "broken.mcap", "--out-dir", out, "--farm", "parallel", "--jobs", 2)
        done = self.retrack(*command)
        resumed = self.retrack(*command, "--resume")
        (out / "b.mcap").unlink()
        mended = self.retrack(*command, "--resume")

        self.assertEqual(done.returncode, 65, done.stderr)
        self.assertIn("3 tracked, 1 failed", done.stdout)
        self.assertRegex(done.stderr, r"broken\.mcap: .*\(log: .*farm/\d\.log\)")
        self.assertEqual(resumed.returncode, 65, resumed.stderr)
        self.assertEqual(mended.returncode, 65, mended.stderr)
        self.expect_results(out)
        self.expect_ctrl_c_to_end_the_farm("parallel", os.environ)

    @unittest.skipIf(slurm.missing(), "Slurm is not installed (Debian packages slurmctld, slurmd, slurm-client, munge)")
    def test_slurm_runs_the_takes(self):
        cluster = slurm.Cluster(self.desk.folder / "cluster")
        self.addCleanup(cluster.end)
        cluster.begin()
        out = self.out("new")
        done = self.retrack(self.takes, "broken.mcap", "--out-dir", out, "--farm", "slurm", environment=cluster.environment)
        killed = self.killed_element(cluster)
        resumed = self.retrack(self.takes, "--out-dir", out, "--farm", "slurm", "--resume", environment=cluster.environment)

        self.assertEqual(done.returncode, 65, done.stderr + done.stdout)
        self.assertIn("3 tracked, 1 failed", done.stdout)
        self.assertRegex(done.stderr, r"broken\.mcap: .*\(log: .*farm/\d\.log\)")
        self.expect_results(out)
        chunks = self.retrack(self.takes / "a.mcap", "--out-dir", self.out("chunks"), "--farm", "slurm", *self.CHUNKS,
                              environment=cluster.environment)
        self.assertEqual(chunks.returncode, 0, chunks.stderr)
        self.expect_chunks_of("a", self.out("chunks"))
        self.assertEqual(killed.returncode, 0, killed.stderr)
        self.assertEqual(resumed.returncode, 0, resumed.stderr)
        self.assertIn("3 there already", resumed.stdout)
        self.expect_ctrl_c_to_end_the_farm("slurm", cluster.environment)
        until(lambda: cluster.run("squeue", "-h") == "", "the job is cancelled")

    def expect_ctrl_c_to_end_the_farm(self, farm, environment):
        out = self.out("stopped")
        arguments = (self.takes, "--out-dir", out, "--farm", farm)
        command = self.begin(*arguments, environment=environment)
        until(lambda: list((out / "farm").glob("*.log")), "a unit runs")
        os.killpg(command.pid, signal.SIGINT)
        output = command.stdout.read()
        self.assertEqual(command.wait(), -signal.SIGINT, output)
        self.assertIn("the same command with --resume goes on", output)
        until(lambda: not self.processes_with(out), "no unit runs")
        resumed = self.retrack(*arguments, "--resume", environment=environment)
        self.assertEqual(resumed.returncode, 0, resumed.stderr)
        self.expect_results(out)

    @staticmethod
    def processes_with(text):
        """Those that have the text in their command lines."""
        found = []
        for process in pathlib.Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                if str(text).encode() in (process / "cmdline").read_bytes():
                    found.append(process.name)
        return found

    def killed_element(self, cluster):
        """Tracks the takes by Slurm; the first worker is killed as soon as it runs."""
        out = self.out("killed")
        marker = self.out("once")
        program = self.desk.write("killed-once.sh", f'#!/bin/sh\nmkdir "{marker}" && kill -9 $$\nexec "{BIN}/mocapctl" "$@"\n')
        program.chmod(0o755)
        dry = self.retrack(self.takes, "--out-dir", out, "--farm", "slurm", "--dry-run")
        script = out / "farm/unit.sh"
        script.write_text(script.read_text().replace(f"'{BIN}/mocapctl'", f"'{program}'"))
        submitted = subprocess.run(["sbatch", "--wait", f"--output={out}/farm/slurm-%a.log", out / "farm/array.sbatch"],
                                   env=cluster.environment, capture_output=True, text=True, timeout=600)
        self.assertEqual(dry.returncode, 0, dry.stderr)
        self.assertTrue(marker.exists(), "a worker was killed")
        self.expect_results(out)
        return submitted

    def test_a_job_template_is_valid(self):
        out = self.out("new")
        done = self.retrack(self.takes, "--out-dir", out, "--farm", "openjd", "--range", 1, 2)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("openjd run", done.stdout)
        template = json.loads((out / "farm/template.json").read_text())

        self.assertEqual(openjd_template.faults_of(template), [])
        self.assertEqual(self.tasks_of(template["steps"][0]), 3)
        self.run_tasks(template["steps"][0])
        self.assertEqual(len(list(out.glob("*.mcap"))), 3)

    def test_a_job_template_tracks_and_joins_chunks(self):
        out = self.out("new")
        done = self.retrack(self.takes / "a.mcap", self.takes / "b.mcap", "--out-dir", out, "--farm", "openjd", *self.CHUNKS)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("--step join --run-dependencies", done.stdout)
        template = json.loads((out / "farm/template.json").read_text())

        self.assertEqual(openjd_template.faults_of(template), [])
        self.assertEqual([self.tasks_of(step) for step in template["steps"]], [6, 2])
        for step in template["steps"]:
            self.run_tasks(step)
        self.expect_chunks_of("a", out)
        self.expect_chunks_of("b", out)

    @staticmethod
    def tasks_of(step):
        return len(step["parameterSpace"]["taskParameterDefinitions"][0]["range"])

    def run_tasks(self, step):
        """Runs the tasks of a step as a worker does: values in the place of references."""
        action = step["script"]["actions"]["onRun"]
        for task in range(self.tasks_of(step)):
            words = [action["command"], *action["args"]]
            for parameter in step["parameterSpace"]["taskParameterDefinitions"]:
                words = [word.replace("{{Task.Param.%s}}" % parameter["name"], parameter["range"][task]) for word in words]
            done = subprocess.run(words, cwd="/", capture_output=True, text=True, timeout=300)
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_the_check_of_templates_finds_faults(self):
        valid = {"specificationVersion": "jobtemplate-2023-09", "name": "n", "steps": [{
            "name": "s", "parameterSpace": {"taskParameterDefinitions": [
                {"name": "A", "type": "PATH", "range": ["/a", "/b"]}, {"name": "B", "type": "PATH", "range": ["/c", "/d"]}],
                "combination": "(A, B)"},
            "script": {"actions": {"onRun": {"command": "x", "args": ["{{Task.Param.A}}"]}}}}]}
        self.assertEqual(openjd_template.faults_of(valid), [])

        def step(template):
            return template["steps"][0]

        def parameters(template):
            return step(template)["parameterSpace"]["taskParameterDefinitions"]

        def action(template):
            return step(template)["script"]["actions"]["onRun"]

        faulty = [
            lambda t: t.update(specificationVersion="2023-09"),
            lambda t: t.update(extra=1),
            lambda t: t.pop("name"),
            lambda t: t.update(name="x" * 129),
            lambda t: t.update(steps=[]),
            lambda t: t["steps"].append(copy.deepcopy(step(t))),
            lambda t: step(t).update(dependencies=[{"dependsOn": "other"}]),
            lambda t: step(t).update(dependencies=[{"dependsOn": "s"}]),
            lambda t: parameters(t)[0].update(type="FILE"),
            lambda t: parameters(t)[0].update(name="1A"),
            lambda t: parameters(t)[0]["range"].pop(),
            lambda t: parameters(t)[0].update(range=["/x"] * 1025),
            lambda t: step(t)["parameterSpace"].update(combination="(A)"),
            lambda t: action(t).update(args=["{{Task.Param.C}}"]),
            lambda t: action(t).update(args=["a\nb"]),
            lambda t: action(t).update(args=["{{Task.Param.A"]),
            lambda t: action(t).update(cancelation={"mode": "TERMINATE", "notifyPeriodInSeconds": 3}),
        ]
        for number, spoil in enumerate(faulty):
            template = copy.deepcopy(valid)
            spoil(template)
            self.assertNotEqual(openjd_template.faults_of(template), [], f"fault {number}")


if __name__ == "__main__":
    unittest.main(verbosity=2)
