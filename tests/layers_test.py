#!/usr/bin/python3
"""Checks the include table of the daemon, and tests layers.py itself."""

import pathlib
import tempfile
import unittest

import layers

DAEMON = pathlib.Path(__file__).parent.parent / "daemon"


class TheDaemon(unittest.TestCase):
    def test_has_no_include_that_points_upward_or_sideways(self):
        self.assertEqual(layers.faults_in(DAEMON), [])


class TheCheck(unittest.TestCase):
    def faults_of(self, name, include):
        """The faults of a daemon that consists of one file with one include."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"#pragma once\n\n#include {include}\n")
            return [fault.replace(folder + "/", "") for fault in layers.faults_in(pathlib.Path(folder))]

    def assert_fault(self, name, include, expected):
        faults = self.faults_of(name, include)
        self.assertEqual(len(faults), 1, faults)
        self.assertTrue(faults[0].startswith(f"{name}:3: "), faults)
        self.assertIn(expected, faults[0])

    def assert_fine(self, name, include):
        self.assertEqual(self.faults_of(name, include), [])

    def test_finds_an_include_that_points_upward(self):
        self.assert_fault("geometry/lens.cpp", '"fusion/fusion.h"', "points upward or sideways")
        self.assert_fault("module/camera.h", '"cameras/open_camera.h"', "points upward or sideways")
        self.assert_fault("base/log.h", '"model/ids.h"', "points upward or sideways: base may include itself")

    def test_finds_an_include_that_points_sideways(self):
        self.assert_fault("geometry/lens.cpp", '"filter/kalman.h"', "points upward or sideways")
        self.assert_fault("fusion/fusion.cpp", '"cameras/open_camera.h"', "points upward or sideways")
        self.assert_fault("runtime/pipeline.cpp", '"settings/daemon_settings.h"', "points upward or sideways")
        self.assert_fault("runtime/pipeline.cpp", '"assemble.h"', "is in no folder")

    def test_finds_a_third_party_in_another_folder(self):
        self.assert_fault("fusion/fusion.cpp", "<zmq.h>", "ZeroMQ is not for fusion")
        self.assert_fault("fusion/fusion.cpp", "<opencv2/core.hpp>", "OpenCV is not for fusion")
        self.assert_fault("runtime/pipeline.cpp", "<systemd/sd-daemon.h>", "libsystemd is not for runtime")
        self.assert_fault("base/time.h", "<Eigen/Core>", "Eigen is not for base")
        self.assert_fault("model/ids.h", "<boost/any.hpp>", "belongs to no third party of the design")

    def test_finds_a_third_party_in_a_header(self):
        self.assert_fault("settings/rig/rig_file.h", "<toml++/toml.h>", "toml++ is not for settings's headers")
        self.assert_fault("cameras/aravis/aravis_camera.h", "<arv.h>", "Aravis is not for cameras")
        self.assert_fault("base/log.h", "<fmt/format.h>", "fmt is not for base's headers")

    def test_finds_the_log_in_a_pure_folder(self):
        self.assert_fault("fusion/fusion.cpp", '"base/log.h"', "the folder is pure")
        self.assert_fault("calibration/wand/solve_wand.cpp", '"base/log.h"', "the folder is pure")

    def test_finds_relative_paths_unknown_folders_and_missing_guards(self):
        self.assert_fault("fusion/fusion.cpp", '"../model/ids.h"', "is a relative path")
        self.assertIn("is not a folder of the design", self.faults_of("utils/misc.cpp", "<vector>")[0])
        with tempfile.TemporaryDirectory() as folder:
            header = pathlib.Path(folder) / "model" / "ids.h"
            header.parent.mkdir()
            header.write_text("struct Id {};\n")
            self.assertIn("has no #pragma once", layers.faults_in(pathlib.Path(folder))[0])

    def test_accepts_an_include_that_points_downward(self):
        self.assert_fine("fusion/fusion.cpp", '"drift/drift_watch.h"')
        self.assert_fine("fusion/fusion.h", "<Eigen/Core>")
        self.assert_fine("settings/rig/rig_file.cpp", "<toml++/toml.h>")
        self.assert_fine("settings/daemon_settings.h", '"synchronise/frame_aligner.h"')
        self.assert_fine("wire/codec/encode.h", '"mocap/v1/snapshot.pb.h"')
        self.assert_fine("runtime/process/service.cpp", "<systemd/sd-daemon.h>")
        self.assert_fine("cameras/v4l2/v4l2_camera.cpp", "<linux/videodev2.h>")
        self.assert_fine("base/wake_signal.cpp", "<linux/futex.h>")
        self.assert_fine("main.cpp", '"runtime/pipeline.h"')
        self.assert_fine("model/ids.h", "<compare>")


if __name__ == "__main__":
    unittest.main()
