#!/usr/bin/env python3
"""Runs the fuzzers for a time: each with one seed after the other, each seed with the number of inputs of the test run.

usage: tests/fuzz.py [--minutes M] [--jobs N] [--build FOLDER] [--first SEED] [TARGET...]

TARGET: detect, mcap, ...; without one, all. M minutes for each target (default 10). The sanitizers are those of the build
(default build/asan, which must be built: cmake --preset asan && cmake --build --preset asan --target unit_tests).

A failure is repeated by the command that is printed: a seed gives the same inputs on every machine. The tests themselves have
seed 1; this command begins with seed 2.

exit codes: 0 nothing found, 64 wrong command line, 65 a fuzzer failed, 69 no such build
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
SKIPPED = 77
LIMIT_S = 1800  # for one seed, which takes seconds


def sanitizer_options():
    """The environment of the sanitizers, which CMakePresets.json sets for the tests."""
    presets = json.loads((ROOT / "CMakePresets.json").read_text())["testPresets"]
    options = next(preset["environment"] for preset in presets if preset["name"] == "asan")
    options = {name: value.replace("${sourceDir}", str(ROOT)) for name, value in options.items()}
    options["ASAN_OPTIONS"] += ":detect_stack_use_after_return=1"
    return options


def targets_of(build):
    """The command of each fuzzer as the tests run it, by its name."""
    listed = subprocess.run(["ctest", "--test-dir", build, "-L", "^fuzz$", "--show-only=json-v1"], capture_output=True, text=True,
                            check=False)
    tests = json.loads(listed.stdout)["tests"] if listed.returncode == 0 else []
    return {test["name"].removeprefix("fuzz."): test.get("command") for test in tests}  # without command: not built


def run(name, command, minutes, first):
    """Runs one fuzzer. Returns its line of the report, and whether nothing was found."""
    began, seeds = time.monotonic(), 0
    while seeds == 0 or time.monotonic() < began + 60 * minutes:
        call = command + [str(first + seeds)]
        try:
            done = subprocess.run(call, capture_output=True, text=True, errors="replace", timeout=LIMIT_S, check=False)
        except subprocess.TimeoutExpired:
            return f"{name}: FAILED, no end within {LIMIT_S} s: {' '.join(call)}", False
        if done.returncode == SKIPPED:
            return f"{name}: {done.stdout.strip()}", True
        if done.returncode != 0:
            return f"{name}: FAILED, repeat with: {' '.join(call)}\n{done.stdout[-500:]}{done.stderr[-6000:]}", False
        seeds += 1
    inputs = seeds * int(command[-1])
    return f"{name}: {seeds} seeds, {inputs} inputs in {time.monotonic() - began:.0f} s, nothing found", True


def wrong(what):
    print(f"fuzz: {what}; see --help", file=sys.stderr)
    sys.exit(64)


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("--minutes", type=float, default=10)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--build", default=str(ROOT / "build/asan"))
    parser.add_argument("--first", type=int, default=2)
    parser.add_argument("targets", nargs="*")
    parser.error = wrong
    arguments = parser.parse_args()
    known = targets_of(arguments.build)
    if not known:
        print(f"fuzz: {arguments.build} has no fuzzers; build them, see --help", file=sys.stderr)
        return 69
    unknown = [name for name in arguments.targets if name not in known]
    if unknown:
        wrong(f"unknown target '{unknown[0]}', expected one of: {' '.join(known)}")
    names = arguments.targets or list(known)
    missing = [name for name in names if not known[name]]
    if missing:
        print(f"fuzz: not built in {arguments.build}: {' '.join(missing)}; see --help", file=sys.stderr)
        return 69
    os.environ.update(sanitizer_options())
    well = True
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        runs = [pool.submit(run, name, known[name], arguments.minutes, arguments.first) for name in names]
        for each in concurrent.futures.as_completed(runs):
            line, found_nothing = each.result()
            print(line, flush=True)
            well = well and found_nothing
    return 0 if well else 65


if __name__ == "__main__":
    sys.exit(main())
