#!/usr/bin/env python3
"""Checks that every test that .github/SECURITY.md names exists."""

import pathlib
import re
import unittest

TESTS = pathlib.Path(__file__).resolve().parent
PAGE = TESTS.parent / ".github/SECURITY.md"
CODE = re.compile(r"TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\)|^    def (test_\w+)\(|add_test\(NAME ([\w.]+)|mocap_(system|fuzz)_test\((\w+)", re.M)


def tests_there():
    """The names of all tests: Suite.Name, test_name, system.name, name_fuzz."""
    names = set()
    for path in [*TESTS.rglob("*_test.cpp"), *TESTS.rglob("*_test.py"), *TESTS.rglob("CMakeLists.txt")]:
        for suite, test, function, added, kind, what in CODE.findall(path.read_text(encoding="utf-8")):
            fuzz_or_system = f"{what}_fuzz" if kind == "fuzz" else f"system.{what}"
            names.add(f"{suite}.{test}" if suite else function or added or fuzz_or_system)
    return names


def named_in(text):
    """The tests that the page names, without its commands and files that are no tests."""
    words = re.findall(r"`([^`\s]+)`", text)
    return [word for word in words if re.match(r"[A-Z]\w+\.[A-Z]\w+$|test_\w+$|system\.|\w+_fuzz$|\S*_test\.(cpp|py)$", word)]


class Promises(unittest.TestCase):
    def test_of_the_security_page_name_tests_that_exist(self):
        named = named_in(PAGE.read_text(encoding="utf-8"))
        self.assertGreater(len(named), 20)
        there = tests_there() | {str(path.relative_to(TESTS.parent)) for path in TESTS.rglob("*_test.*")} | {
            path.name for path in TESTS.rglob("*_test.py")}

        self.assertEqual([name for name in named if name not in there], [])


if __name__ == "__main__":
    unittest.main()
