#!/usr/bin/python3
"""Tests of links.py: it reports links without a target and accepts the others."""

import pathlib
import tempfile
import unittest

import links


class TheCheck(unittest.TestCase):
    def faults_of(self, text):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "page.md").write_text(text)
            (folder / "other.md").write_text("# Some heading: it's here\n")
            return links.faults_in(folder, ["page.md"])

    def test_finds_a_link_to_a_file_that_is_missing(self):
        self.assertEqual(self.faults_of("see\n[this](gone.md)\n"), ["page.md:2: 'gone.md' is not a file"])

    def test_finds_a_picture_that_is_missing(self):
        self.assertEqual(len(self.faults_of("![a](gone.svg)")), 1)

    def test_finds_an_anchor_without_a_heading(self):
        self.assertEqual(len(self.faults_of("[a](other.md#elsewhere)")), 1)

    def test_accepts_files_headings_other_sites_and_code(self):
        self.assertEqual(self.faults_of("[a](other.md) [b](other.md#some-heading-its-here) [c](https://example.org/x)\n"
                                        "`[d](gone.md)`\n```\n[e](gone.md)\n```\n"), [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
