#!/usr/bin/python3
"""Checks the standard headers of every header, and tests std_includes.py itself."""

import unittest

import std_includes


class TheHeaders(unittest.TestCase):
    def test_include_what_they_use(self):
        self.assertEqual(std_includes.main([]), 0)


class TheCheck(unittest.TestCase):
    def assert_fault(self, text, line, expected):
        faults = std_includes.faults_of(text)
        self.assertEqual([found for found, _ in faults], [line], faults)
        self.assertIn(expected, faults[0][1])

    def assert_fine(self, text):
        self.assertEqual(std_includes.faults_of(text), [])

    def test_finds_a_missing_header_with_its_line(self):
        self.assert_fault("#pragma once\n\n#include <span>\n\nstd::span<int> a;\nstd::vector<int> b;\n", 6, "uses std::vector without #include <vector>")

    def test_counts_the_lines_of_comments(self):
        self.assert_fault("/* two\n   lines */\n// one\nstd::optional<int> a;\n", 4, "#include <optional>")

    def test_names_the_folder_of_a_library(self):
        self.assert_fault("Eigen::Vector3d a;\n", 1, "uses Eigen:: without #include <Eigen/...>")

    def test_takes_an_included_header_for_granted(self):
        self.assert_fine("#include <Eigen/Core>\n#include <cstdint>\n\nEigen::Vector3d a;\nstd::uint8_t b;\nuint16_t c;\n")

    def test_takes_the_header_of_c_for_that_of_cpp(self):
        self.assert_fine("#include <stdint.h>\n\nuint16_t a;\n")

    def test_ignores_comments_strings_and_names_of_others(self):
        self.assert_fine('// std::vector\nconst char* a = "std::vector";\nmy::vector b;\nstd::vector_of_ours c;\n')

    def test_covers_each_header_of_the_precompiled_header(self):
        text = (std_includes.ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
        begin = text.index("set(MOCAP_READ_OFTEN")
        read_often = std_includes.re.findall(r"<([^>]+)>", text[begin:text.index(")", begin)])
        self.assertGreater(len(read_often), 10)
        for header in read_often:
            covered = header in std_includes.NAMES or header.split("/")[0] + "/" in std_includes.NAMES
            self.assertTrue(covered, f"std_includes.NAMES has no names of <{header}>")


if __name__ == "__main__":
    unittest.main()
