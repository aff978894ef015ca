#!/usr/bin/python3
"""Checks that each header includes the headers of the standard library, of Eigen and of fmt whose names it uses.

The build compiles with a precompiled header, so the compiler does not notice if one of its headers is missing.

usage: std_includes.py [FILE ...]     default: every header of daemon/ and tools/; prints each fault as file:line: fault;
                                      exit code 1 if there is any
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).parent.parent

# A header of the precompiled header (MOCAP_READ_OFTEN in CMakeLists.txt): the names that it declares, as a pattern.
NAMES = {
    "algorithm": r"std::(ranges::)?(all_of|any_of|clamp|copy|copy_n|count|count_if|equal|fill|fill_n|find|find_if|for_each|lower_bound|"
                 r"max|max_element|min|min_element|minmax|none_of|nth_element|partial_sort|remove_if|replace|reverse|rotate|sort|"
                 r"stable_sort|transform|unique|upper_bound)\b",
    "array": r"std::array\b",
    "chrono": r"std::chrono::",
    "cmath": r"std::(acos|asin|atan2|atan|ceil|cos|exp|floor|fmod|hypot|isfinite|isnan|log|lround|pow|round|sin|sqrt|tan)\(",
    "cstdint": r"\bu?int(8|16|32|64)_t\b",
    "filesystem": r"std::filesystem::",
    "fstream": r"std::(basic_)?[io]?fstream\b",
    "functional": r"std::(function|reference_wrapper|invoke|ref|cref|less|greater|plus)\b",
    "map": r"std::(multi)?map\b",
    "memory": r"std::(unique_ptr|shared_ptr|weak_ptr|make_unique|make_shared|enable_shared_from_this)\b",
    "numbers": r"std::numbers::",
    "optional": r"std::(optional|nullopt)\b",
    "random": r"std::(mt19937(_64)?|\w+_distribution)\b",
    "span": r"std::span\b",
    "string": r"std::(string|to_string)\b",
    "string_view": r"std::string_view\b",
    "utility": r"std::(pair|move|forward|exchange|swap|declval)\b",
    "vector": r"std::vector\b",
    "Eigen/": r"\bEigen::",
    "fmt/": r"\bfmt::",
}
# The name of a header in C.
IN_C = {"cstdint": "stdint.h", "cmath": "math.h"}
NAMES = {header: re.compile(pattern) for header, pattern in NAMES.items()}
INCLUDE = re.compile(r"^[ \t]*#[ \t]*include[ \t]*[<\"]([^>\"]+)[>\"]", re.MULTILINE)
# Text that is not code: comments and string literals.
NOT_CODE = re.compile(r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"", re.DOTALL)


def code_of(text):
    """The text without comments and string literals, with the same lines."""
    return NOT_CODE.sub(lambda found: "\n" * found.group().count("\n"), text)


def faults_of(text):
    """The (line, fault) of each standard header that the text of a header uses and does not include."""
    included = INCLUDE.findall(text)
    code = code_of(INCLUDE.sub("", text))
    faults = []
    for header, pattern in NAMES.items():
        if any(name in (header, IN_C.get(header)) or (header.endswith("/") and name.startswith(header)) for name in included):
            continue
        used = pattern.search(code)
        if used:
            line = code.count("\n", 0, used.start()) + 1
            name = header + "..." if header.endswith("/") else header
            faults.append((line, f"uses {used.group().rstrip('(')} without #include <{name}>"))
    return sorted(faults)


def main(paths):
    files = [pathlib.Path(path) for path in paths] or sorted(
        path for folder in ("daemon", "tools") for path in (ROOT / folder).rglob("*.h"))
    found = 0
    for path in files:
        for line, fault in faults_of(path.read_text(encoding="utf-8")):
            found += 1
            print(f"{path}:{line}: {fault}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
