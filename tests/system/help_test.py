"""Every program and every subcommand has --version, and --help that fits 80 columns and has examples of its own."""

import re
import subprocess
import unittest

from harness import BIN, Desk

PROGRAMS = ["mocapd", "mocapctl", "mocap-watch", "mocap-sim", "mocap-score", "mocap-eval", "mocap-bench",
            "mocap-calibrate", "mocap-web", "mocap-vmc", "mocap-vrpn", "mocap-rokoko", "mocap-natnet", "mocap-relay"]
COLUMNS = 80


def subcommands_in(help_text):
    """The names of the list of subcommands, as CLI11 or run_command prints the list."""
    listed = re.search(r"^(?:Subcommands|usage: \S+ COMMAND.*):?\n\n?((?:  .*\n)+)", help_text, re.MULTILINE)
    return re.findall(r"^  ([a-z]\S*)", listed.group(1), re.MULTILINE) if listed else []


class Help(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)

    def commands(self, words):
        """The command `words` and all its subcommands, each with its help text."""
        ended = self.desk.run(*words, "--help")
        self.assertEqual(ended.returncode, 0, f"{words}: {ended.stderr}")
        yield words, ended.stdout
        for name in subcommands_in(ended.stdout):
            yield from self.commands([*words, name])

    def test_every_command_has_examples_of_its_own(self):
        count = 0
        for program in PROGRAMS:
            for words, text in self.commands([program]):
                count += 1
                with self.subTest(command=" ".join(words)):
                    examples = text.partition("examples:\n")[2]
                    # `mocap-eval labels` is `mocap-score labels`, so any program may be named.
                    self.assertRegex(examples, rf"(?m)^  .*\b{' '.join(['mocap[a-z-]*', *words[1:]])}\b")
        self.assertGreater(count, 50)  # the lists of subcommands were found

    def test_every_command_prints_its_version(self):
        for program in PROGRAMS:
            for words, _ in self.commands([program]):
                with self.subTest(command=" ".join(words)):
                    ended = self.desk.run(*words, "--version")
                    self.assertEqual(ended.returncode, 0, ended.stderr)
                    name = program if len(words) == 1 else "mocap[a-z-]*"
                    self.assertRegex(ended.stdout, rf"^{name} \d+\.\d+\.\d+\n$")

    def test_daemon_and_clients_load_few_libraries(self):
        """The libraries that a program loads decide how soon it starts; OpenCV brings more than a hundred."""
        for program in ("mocapd", "mocapctl", "mocap-watch", "mocap-sim", "mocap-score", "mocap-vmc", "mocap-vrpn", "mocap-rokoko",
                        "mocap-natnet", "mocap-relay"):
            libraries = subprocess.run(["ldd", BIN / program], check=True, capture_output=True, text=True).stdout

            self.assertNotIn("libopencv", libraries, program)
            self.assertLess(len(libraries.splitlines()), 80, program)

    def test_lines_fit_in_80_columns(self):
        for program in PROGRAMS:
            for words, text in self.commands([program]):
                # The column of names is CLI11's own: names, type and range of one option stay on one line.
                wide = [line for line in text.splitlines() if len(line) > COLUMNS and not re.match(r"  -|Usage:", line)]
                with self.subTest(command=" ".join(words)):
                    self.assertEqual(wide, [])

    def test_the_floor_command_has_the_option_that_its_messages_name(self):
        self.assertIn("--frame", self.desk.run("mocap-calibrate", "floor", "--help").stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
