#!/usr/bin/env python3
"""Prints which share of the lines of each parser the fuzzers run.

usage: tests/parser_coverage.py [--missed] [TARGET...]

Builds the fuzzers with gcov in build/coverage, runs each with the inputs of the test run (seed 1), and prints a line for each
parser. TARGET: detect, mcap, ...; without one, all. --missed also lists the lines that no input reached.

exit codes: 0 each target has at least 85 %, 64 wrong command line, 65 a target has less, 70 build or fuzzer failed
"""

import argparse
import collections
import json
import os
import pathlib
import subprocess
import sys

from fuzz import targets_of

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / "build/coverage"
GOAL = 0.85
# The files of each target that read bytes from elsewhere.
PARSERS = {
    "client": ["tools/clients/c/decode_*.cpp", "tools/clients/c/feed.cpp", "tools/clients/c/text.cpp"],
    "configuration": ["daemon/settings/toml/[!t]*.cpp", "daemon/settings/toml/toml_file.cpp", "daemon/settings/daemon_settings.cpp",
                      "daemon/settings/packed_files.cpp", "daemon/settings/sections.cpp"],
    "control": ["daemon/wire/codec/control_codec.cpp", "daemon/wire/codec/decode*.cpp", "daemon/wire/codec/utf8.cpp"],
    "detect": ["daemon/detect/pixel_rows.cpp"],
    "files": ["daemon/take/recorder/shot_list.cpp", "daemon/wire/curve_keys.cpp", "daemon/cameras/replay/replay_recording.cpp",
              "daemon/take/recordings/blob_recording.cpp", "daemon/wire/codec/json.cpp"],
    "gvcp": ["tools/sim/gvcp_command.cpp"],
    "image": ["daemon/cameras/replay/image_file.cpp", "daemon/cameras/jpeg_decoder.cpp", "daemon/cameras/tcp/tcp_header.cpp"],
    "lite": ["tools/clients/c/lite.cpp", "daemon/wire/codec/lite*.cpp"],
    "mcap": ["daemon/take/mcap/*.cpp", "daemon/take/take_reader.cpp"],
    "motion": ["daemon/scene/c3d.cpp", "daemon/scene/bvh.cpp", "tools/lib/simworld/trc_file.cpp"],
    "natnet": ["tools/bridges/natnet/request.cpp", "tools/bridges/natnet/command.cpp"],
    "node": ["daemon/wire/node_link.cpp", "daemon/wire/zmq_node_server.cpp", "daemon/cameras/node/node_camera.cpp"],
    "rig": ["daemon/settings/rig/rig_*.cpp", "daemon/calibration/formats/*.cpp"],
    "subject": ["daemon/settings/subject/marker_set_file.cpp", "daemon/settings/subject/subject_file.cpp"],
    "subscription": ["daemon/wire/subscriptions.cpp"],
    "timecode": ["daemon/timecode/wav_file.cpp", "daemon/timecode/ltc_*.cpp", "daemon/timecode/fly_wheel.cpp", "daemon/model/clock/timecode.cpp"],
    "trigger": ["daemon/trigger/xml_packet.cpp", "daemon/trigger/osc_packet.cpp", "daemon/trigger/ip4.cpp", "daemon/trigger/request.cpp"],
    "vrpn": ["tools/bridges/vrpn/session.cpp", "tools/bridges/vrpn/message.cpp"],
    "web": ["tools/web/http/*_session.h", "tools/web/feed/page_message.cpp", "tools/web/query.cpp", "tools/web/api.cpp"],
}


def build():
    environment = os.environ | {"CCACHE_BASEDIR": str(ROOT), "CCACHE_NOHASHDIR": "1"}
    for command in (["cmake", "--preset", "coverage"], ["cmake", "--build", "--preset", "coverage"]):
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"parser_coverage: {' '.join(command)}: {(done.stdout + done.stderr)[-3000:]}")


def run(name, command):
    for old in BUILD.rglob("*.gcda"):
        old.unlink()
    done = subprocess.run(command + ["1"], capture_output=True, text=True, errors="replace", check=False)
    if done.returncode not in (0, 77):
        sys.exit(f"parser_coverage: {name}: {done.stdout[-500:]}{done.stderr[-3000:]}")


def counts_of(files):
    """How often each line of the files ran: path, line, count. Templates have one count for each use."""
    counts = collections.defaultdict(dict)
    data = [str(path) for path in BUILD.rglob("*.gcda")]
    said = subprocess.run(["gcov", "--json-format", "--stdout", *data], cwd=BUILD, capture_output=True, text=True, check=True)
    for one in filter(None, said.stdout.splitlines()):
        for source in json.loads(one)["files"]:
            path = (BUILD / source["file"]).resolve()
            if path not in files:
                continue
            lines = counts[path]
            for line in source["lines"]:
                lines[line["line_number"]] = lines.get(line["line_number"], 0) + line["count"]
    return counts


def report(target, files, counts, missed):
    """Prints the lines of one target; returns its share."""
    all_lines = all_run = 0
    for path in sorted(files):
        lines = counts.get(path, {})
        reached = sum(1 for count in lines.values() if count > 0)
        all_lines, all_run = all_lines + len(lines), all_run + reached
        share = f"{100 * reached / len(lines):5.1f} %" if lines else "not built or never run"
        print(f"{target:14} {path.relative_to(ROOT)!s:50} {reached:5} of {len(lines):5} lines {share}")
        if missed:
            print("               missed: " + ", ".join(str(number) for number in sorted(lines) if lines[number] == 0))
    share = all_run / all_lines if all_lines else 0.0
    print(f"{target:14} {'all':50} {all_run:5} of {all_lines:5} lines {100 * share:5.1f} %", flush=True)
    return share


def wrong(what):
    print(f"parser_coverage: {what}; see --help", file=sys.stderr)
    sys.exit(64)


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("--missed", action="store_true")
    parser.add_argument("targets", nargs="*")
    parser.error = wrong
    arguments = parser.parse_args()
    unknown = [name for name in arguments.targets if name not in PARSERS]
    if unknown:
        wrong(f"unknown target '{unknown[0]}', expected one of: {' '.join(PARSERS)}")
    build()
    commands = targets_of(str(BUILD))
    low = []
    for target in arguments.targets or PARSERS:
        files = {path for pattern in PARSERS[target] for path in ROOT.glob(pattern)}
        run(target, commands[target])
        if report(target, files, counts_of(files), arguments.missed) < GOAL:
            low.append(target)
    if low:
        print(f"under {100 * GOAL:.0f} %: {' '.join(low)}")
    return 65 if low else 0


if __name__ == "__main__":
    sys.exit(main())
