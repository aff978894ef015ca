#!/usr/bin/env python3
"""usage: slowest_files.py NINJA_LOG [COUNT]

Prints the files with the longest compile times, in seconds of wall time, from the last build of each file in Ninja's
log. A file from the ccache takes no time; CCACHE_RECACHE=1 compiles it again.
"""
import sys


def durations_s(log: str) -> dict[str, float]:
    """Duration of the last build of each output. The columns of Ninja's log: start, end (ms), modification time, output, hash."""
    found = {}
    for line in log.splitlines():
        if line.startswith("#"):
            continue
        start, end, _, output, _ = line.split("\t")
        if output.endswith((".o", ".gch")):
            found[output] = (int(end) - int(start)) / 1000.0
    return found


def main() -> int:
    if len(sys.argv) not in (2, 3) or sys.argv[1] in ("-h", "--help"):
        print(__doc__.strip())
        return 0 if sys.argv[1:] in (["-h"], ["--help"]) else 64
    try:
        with open(sys.argv[1], encoding="utf-8") as file:
            found = durations_s(file.read())
    except OSError as error:
        print(f"slowest_files: {error}; build first, with Ninja", file=sys.stderr)
        return 66
    count = int(sys.argv[2]) if len(sys.argv) == 3 else 10
    for output, seconds in sorted(found.items(), key=lambda one: -one[1])[:count]:
        print(f"{seconds:7.1f} s  {output}")
    print(f"{sum(found.values()):7.1f} s  all {len(found)} files, one after another")
    return 0


if __name__ == "__main__":
    sys.exit(main())
