#!/usr/bin/python3
"""Tests of why_failed.py, on a log that ctest writes here."""

import pathlib
import subprocess
import tempfile
import unittest

import why_failed

TESTS = """cmake_minimum_required(VERSION 3.20)
project(tests NONE)
enable_testing()
add_test(NAME passes COMMAND echo "AssertionError: told, but no failure")
add_test(NAME fails COMMAND sh -c "echo about; exit 1")
add_test(NAME is_silent COMMAND false)
add_test(NAME is_slow COMMAND sleep 600)
set_tests_properties(is_slow PROPERTIES TIMEOUT 1)
add_test(NAME is_skipped COMMAND echo SKIPPED)
set_tests_properties(is_skipped PROPERTIES SKIP_REGULAR_EXPRESSION SKIPPED)
add_test(NAME says_77 COMMAND echo 77)
set_tests_properties(says_77 PROPERTIES FAIL_REGULAR_EXPRESSION 77)
"""
UNITTEST = """seed 1: 40 orders
======================================================================
FAIL: test_x (__main__.A.test_x) (seed=3)
----------------------------------------------------------------------
Traceback (most recent call last):
  File "a_test.py", line 4, in test_x
AssertionError: 1 != 2 : the daemon said
that it ended
----------------------------------------------------------------------
Ran 1 test in 0.003s
"""
GOOGLE_TEST = """[ RUN      ] Filter.IsStable
filter_test.cpp:12: Failure
Expected equality of these values:
  a
    Which is: 1
  b
    Which is: 2
[  FAILED  ] Filter.IsStable (1 ms)
"""


class TheReasons(unittest.TestCase):
    def test_are_told_for_each_test_that_failed(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "CMakeLists.txt").write_text(TESTS)
            subprocess.run(["cmake", "-B", "build"], cwd=folder, check=True, capture_output=True)
            subprocess.run(["ctest", "--test-dir", "build"], cwd=folder, check=False, capture_output=True)
            log = (folder / "build/Testing/Temporary/LastTest.log").read_text()

        failures = {name: reasons for name, _, reasons in why_failed.failures_in(log)}

        self.assertEqual(failures, {"fails": ["about"], "is_silent": ["(no output)"], "is_slow": ["(no output)"], "says_77": ["77"]})

    def test_of_unittest_are_the_name_and_the_message(self):
        self.assertEqual(why_failed.reasons_in(UNITTEST)[:3],
                         ["FAIL: test_x (__main__.A.test_x) (seed=3)", "AssertionError: 1 != 2 : the daemon said", "that it ended"])

    def test_of_googletest_are_place_and_values(self):
        self.assertEqual(why_failed.reasons_in(GOOGLE_TEST), GOOGLE_TEST.splitlines()[1:-1])


if __name__ == "__main__":
    unittest.main(verbosity=2)
