#!/usr/bin/python3
"""Checks that every include of the daemon points downward in the include table, and that third-party headers occur only in the folders that may include them.

usage: layers.py [DAEMON_FOLDER]      prints each fault as file:line: fault; exit code 1 if there is any

The include table is the USES list of each `mocap_folder(...)` in daemon/CMakeLists.txt: the build and this check read the
same lines.
"""

import pathlib
import re
import sys

DAEMON = pathlib.Path(__file__).parent.parent / "daemon"

FOLDER_RULE = re.compile(r"^mocap_folder\(\s*(\w+)([^)]*)\)", re.MULTILINE)


def include_table(cmake_lists):
    """Folder -> set of the folders that it may include, from the text of daemon/CMakeLists.txt."""
    table = {}
    for folder, arguments in FOLDER_RULE.findall(cmake_lists):
        uses = re.search(r"\bUSES\b([^()]*?)(?=\bWITH\b|\bHOT_LOOPS\b|$)", arguments, re.DOTALL)
        table[folder] = set(uses.group(1).split()) if uses else set()
    return table


BELOW = include_table((DAEMON / "CMakeLists.txt").read_text(encoding="utf-8"))

# The types of model/ contain Eigen types, so a folder that includes model/ may include Eigen.
EIGEN_USERS = " ".join(f"{folder}/" for folder, below in BELOW.items() if "model" in below or folder == "model")
FMT_USERS = " ".join(folder for folder in BELOW if folder != "module")

# A third party: the pattern of its headers, and the users that may include them. "folder" allows the folder's .cpp files,
# "folder/" its headers too, "folder/part" the .cpp files below that path, "file.cpp" one file.
THIRD_PARTIES = {
    "Eigen": (r"(unsupported/)?Eigen/", EIGEN_USERS + " main"),
    "fmt": (r"fmt/", FMT_USERS + " main"),
    "spdlog": (r"spdlog/", "base/log.cpp"),
    "OpenCV": (r"opencv2/", "calibration cameras/replay/plugin/video_plugin.cpp"),
    "Highway": (r"hwy/", "detect/kernels"),
    "Aravis": (r"(arv\w*\.h|arv/|aravis|glib|gio/)", "cameras/aravis"),
    "V4L2": (r"(linux/videodev2\.h|linux/v4l2|libv4l)", "cameras/v4l2"),
    "libpng": (r"png\.h", "cameras/replay"),
    "turbojpeg": (r"(turbojpeg|jpeglib)", "cameras"),
    "Protobuf": (r"(google/protobuf/|mocap/v\d+/)", "wire/ take/"),
    "ZeroMQ": (r"zmq", "wire"),
    "Ceres": (r"(ceres|glog)/", "calibration"),
    "yaml-cpp": (r"yaml-cpp/", "calibration/formats"),
    "toml++": (r"toml", "settings"),
    "libltc": (r"ltc\.h", "timecode"),
    "ALSA": (r"alsa/", "timecode"),
    "libsystemd": (r"systemd/", "runtime/process/service.cpp wire/discovery"),  # sd-notify; sd-bus
    "CLI11": (r"CLI/", "main"),
    "expat": (r"expat", "trigger/xml_packet.cpp"),
    "JSON": (r"nlohmann/", "export take wire"),
    "compression": (r"(zstd|lz4frame|zlib)\.h", "take/mcap"),
}

# Headers of the language and of the system, which any folder may include.
SYSTEM = re.compile(
    r"^([a-z_0-9]+"  # <vector>, <cstdint>
    r"|(sys|linux|netinet|arpa|net)/[a-z_0-9]+\.h"
    r"|(unistd|fcntl|pthread|sched|spawn|poll|signal|dirent|dlfcn|endian|byteswap|[a-z]?mmintrin|immintrin|x86intrin|cpuid|malloc|stdlib|"
    r"string|errno|time|ifaddrs|execinfo|sysexits|syslog|netdb|cxxabi)\.h)$")

# Folders that may log. Every other folder is pure: it computes and returns results and errors to its caller.
MAY_LOG = set("base cameras wire take settings runtime".split())

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def third_party_of(header):
    for name, (pattern, users) in THIRD_PARTIES.items():
        if re.match(pattern, header):
            return name, users.split()
    return None, []


def may_use(user, path, folder):
    """Whether `path` (relative to the daemon's folder, in `folder`) is covered by one entry of a third party's users."""
    if user.endswith("/"):
        return user == folder + "/"
    if user.endswith(".cpp"):
        return user == str(path)
    return path.suffix == ".cpp" and (user == folder or str(path).startswith(user + "/"))


def fault_of(path, folder, bracket, header):
    """The fault of one include in `path` (relative to the daemon's folder), or None."""
    party, users = third_party_of(header)
    if party:
        if any(may_use(user, path, folder) for user in users):
            return None
        where = f"{folder}'s headers" if path.suffix == ".h" and folder in users else folder
        return f"<{header}> of {party} is not for {where}; it is for {', '.join(users)}"
    if bracket == "<":
        return None if SYSTEM.match(header) else f"<{header}> belongs to no third party of the design"
    if header.startswith(".") or "/../" in header:
        return f'"{header}" is a relative path, expected "folder/name.h"'
    other = header.split("/")[0] if "/" in header else "main"
    if other == folder or folder == "main":
        pass
    elif other not in BELOW:
        return f'"{header}" is in no folder of the design'
    elif other not in BELOW[folder]:
        return f'"{header}" points upward or sideways: {folder} may include {" ".join(sorted(BELOW[folder])) or "itself"}'
    if header == "base/log.h" and folder not in MAY_LOG and folder != "main":
        return f'"{header}" is not for {folder}: the folder is pure'
    return None


def faults_in(daemon):
    """Every fault below the folder `daemon`, as text."""
    faults = []
    for path in sorted(daemon.rglob("*")):
        if path.suffix not in (".h", ".cpp"):
            continue
        inside = path.relative_to(daemon)
        folder = inside.parts[0] if len(inside.parts) > 1 else "main"
        if folder not in BELOW and folder != "main":
            faults.append(f"{path}:1: '{folder}' is not a folder of the design")
            continue
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".h" and "#pragma once" not in text:
            faults.append(f"{path}:1: the header has no #pragma once")
        for number, line in enumerate(text.splitlines(), 1):
            found = INCLUDE.match(line)
            fault = found and fault_of(inside, folder, *found.groups())
            if fault:
                faults.append(f"{path}:{number}: {fault}")
    return faults


def main():
    daemon = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else DAEMON
    if not daemon.is_dir():
        print(f"layers: {daemon} is not a folder", file=sys.stderr)
        return 64
    faults = faults_in(daemon)
    print("\n".join(faults) if faults else f"layers: every include of {daemon} points downward")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
