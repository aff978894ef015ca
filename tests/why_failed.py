#!/usr/bin/env python3
"""Prints for each test that failed in the last run of ctest the lines of its output that tell why.

usage: tests/why_failed.py BUILD_FOLDER

exit codes: 0 told, 64 wrong command line, 66 no test ran in the folder
"""

import pathlib
import re
import sys

MOST_LINES, LONGEST_LINE = 12, 400
# One test in the log of ctest: its name, its output, its time, its outcome.
TEST = re.compile(r"^\d+/\d+ Testing: (?P<name>.+?)\n.*?^Output:\n-+\n(?P<output>.*?)<end of output>\n"
                  r"Test time = +(?P<seconds>[\d.]+) sec\n-+\n(?P<outcome>.*?)\n", re.MULTILINE | re.DOTALL)
# What begins a reason, and how many lines of it follow: GoogleTest, unittest, a sanitizer.
REASONS = ((re.compile(r".*: Failure$"), 5), (re.compile(r"(FAIL|ERROR): "), 0),
           (re.compile(r"\S*(Error|Exception|Violation|Damaged|Expired)\b(: |$)"), 2), (re.compile(r".*((ERROR|WARNING): \w+Sanitizer|runtime error): "), 3))


def reasons_in(output):
    """The lines of a test's output that tell why it failed; its last ones if none looks like a reason."""
    lines = [line[:LONGEST_LINE] for line in output.splitlines() if line.strip("-= ")]
    kept, until = [], 0
    for index, line in enumerate(lines):
        following = [count for begins, count in REASONS if begins.match(line)]
        if following:
            until = index + 1 + max(following)
        if index < until:
            kept.append(line)
    return (kept or lines[-5:] or ["(no output)"])[:MOST_LINES]


def failures_in(log):
    """Yields name, seconds and reasons of each test that failed."""
    for test in TEST.finditer(log):
        if not test["outcome"].startswith("Test Pass"):  # "Test Pass Reason:" of a test that was skipped
            yield test["name"], float(test["seconds"]), reasons_in(test["output"])


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 64
    log = pathlib.Path(sys.argv[1]) / "Testing/Temporary/LastTest.log"
    if not log.exists():
        print(f"why_failed: {log} is missing; run ctest there first", file=sys.stderr)
        return 66
    for name, seconds, reasons in failures_in(log.read_text(errors="replace")):
        print(f"--- {name} failed after {seconds:.0f} s:")
        print("\n".join(reasons))
    return 0


if __name__ == "__main__":
    sys.exit(main())
