#!/usr/bin/python3
"""Whether every include of the daemon runs downward, and third parties stay in the rooms that may know them.

usage: layers.py [DAEMON_FOLDER]      prints each fault as file:line: what, and ends with 1 if there is any
"""

import pathlib
import re
import sys

# What each room may include beside itself. The map of the house; a change here is a change of the design.
BELOW = {
    "base": "",
    "model": "base",
    "geometry": "base model",
    "filter": "base model",
    "body": "base model geometry",
    "module": "base model",
    "stages": "base model geometry filter body module",
    "scene": "base model geometry body",
    "cameras": "base model geometry module scene",
    "wire": "base model module",
    "record": "base model module wire",  # wire: a record is written as the feed is
    "calibration": "base model geometry",
    "settings": "base model geometry filter body module stages scene cameras wire record calibration runtime",
    "runtime": "base model module stages",
}
BELOW = {room: set(below.split()) for room, below in BELOW.items()}

# A third party: its headers, and the files that may include it. "room" stands for the room's .cpp files, "room/" for
# its headers too.
THIRD_PARTIES = {
    # The nouns of model/ are made of Eigen: who may include them may include it.
    "Eigen": (r"(unsupported/)?Eigen/", "model/ geometry/ filter/ body/ module/ stages/ scene/ cameras/ wire/ record/ "
              "calibration/ settings/ runtime/ main"),
    "fmt": (r"fmt/", "base model geometry filter body stages scene cameras wire record calibration settings runtime main"),
    "spdlog": (r"spdlog/", "base/log.cpp"),
    "OpenCV": (r"opencv2/", "cameras calibration stages/detect_opencv.cpp"),
    "Highway": (r"hwy/", "stages/detect_kernels.cpp"),
    "Aravis": (r"(arv\w*\.h|arv/|aravis|glib|gio/)", "cameras"),
    "V4L2": (r"(linux/videodev2\.h|linux/v4l2|libv4l)", "cameras"),
    "turbojpeg": (r"(turbojpeg|jpeglib)", "cameras"),
    "Protobuf": (r"(google/protobuf/|mocap/v\d+/)", "wire/ record/"),
    "ZeroMQ": (r"zmq", "wire"),
    "Ceres": (r"(ceres|glog)/", "calibration"),
    "toml++": (r"toml", "settings"),
    "libsystemd": (r"systemd/", "runtime/service.cpp"),
    "CLI11": (r"CLI/", "main"),
    "JSON": (r"nlohmann/", "record wire"),
}

# The language and the system, which any room may use.
SYSTEM = re.compile(
    r"^([a-z_0-9]+"  # <vector>, <cstdint>
    r"|(sys|linux|netinet|arpa|net)/[a-z_0-9]+\.h"
    r"|(unistd|fcntl|pthread|sched|poll|signal|dirent|dlfcn|endian|byteswap|[a-z]?mmintrin|immintrin|x86intrin|cpuid|malloc|stdlib|"
    r"string|errno|time|ifaddrs|execinfo|sysexits|syslog|netdb|cxxabi)\.h)$")

NO_LOG = set("model geometry filter body module stages scene calibration".split())

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def third_party_of(header):
    for name, (pattern, users) in THIRD_PARTIES.items():
        if re.match(pattern, header):
            return name, users.split()
    return None, []


def fault_of(path, room, bracket, header):
    """What is wrong with one include of `path` (relative to the daemon's folder), or None."""
    is_header = path.suffix == ".h"
    party, users = third_party_of(header)
    if party:
        at_home = any(user == str(path) or user == room + "/" or (user == room and not is_header) for user in users)
        if at_home:
            return None
        where = f"{room}'s headers" if room in users else room
        return f"<{header}> of {party} is not for {where}; it is for {', '.join(users)}"
    if bracket == "<":
        return None if SYSTEM.match(header) else f"<{header}> is of no third party that the design knows"
    if header.startswith(".") or "/../" in header:
        return f'"{header}" is a relative path, expected "room/name.h"'
    other = header.split("/")[0] if "/" in header else "main"
    if other == room or room == "main":
        pass
    elif other not in BELOW:
        return f'"{header}" is in no room'
    elif other not in BELOW[room]:
        return f'"{header}" runs upward or sideways: {room} may include {" ".join(sorted(BELOW[room])) or "itself"}'
    if header == "base/log.h" and room in NO_LOG:
        return f'"{header}" is not for {room}: it is pure'
    return None


def faults_in(daemon):
    faults = []
    for path in sorted(daemon.rglob("*")):
        if path.suffix not in (".h", ".cpp"):
            continue
        inside = path.relative_to(daemon)
        room = inside.parts[0] if len(inside.parts) > 1 else "main"
        if room not in BELOW and room != "main":
            faults.append(f"{path}:1: '{room}' is no room of the design")
            continue
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".h" and "#pragma once" not in text:
            faults.append(f"{path}:1: a header without #pragma once")
        for number, line in enumerate(text.splitlines(), 1):
            found = INCLUDE.match(line)
            fault = found and fault_of(inside, room, *found.groups())
            if fault:
                faults.append(f"{path}:{number}: {fault}")
    return faults


def main():
    daemon = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).parent.parent / "daemon"
    if not daemon.is_dir():
        print(f"layers: {daemon} is no folder", file=sys.stderr)
        return 64
    faults = faults_in(daemon)
    print("\n".join(faults) if faults else f"layers: every include of {daemon} runs downward")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
