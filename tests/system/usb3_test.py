"""USB3 Vision on a real kernel: two simulated cameras on the host controllers of dummy_hcd, and two on the one of USB/IP.
Run by guest_vm.sh usb3=2, and usb3=1 usbip=2: that host's hubs make the looking for cameras slower."""

import os
import pathlib
import signal
import unittest

from unplugging import LIMIT_S, Unplugging

CAMERA = """
[[camera]]
name = "cam{number}"
driver = "aravis"
serial = "SIM00{number}"
pixel_format = "{format}"
width_px = 320
height_px = 240
rate_hz = 10
exposure_us = 400
gain_db = {gain}
"""

ROUNDS = int(os.environ.get("MOCAP_REPLUG_ROUNDS") or 5)
SOCKET = pathlib.Path("/sys/kernel/config/usb_gadget/mocap1/UDC")
DEVICES = pathlib.Path("/sys/bus/usb/devices")


class Usb3(Unplugging):
    def setUp(self):
        super().setUp()
        self.sim = self.desk.start("mocap-sim", "--usb3", "--ring", 2, "--size", 320, 240, "--loop-images", 4)
        self.said(self.sim, "camera cam2: plugged in")

    def plug_in(self):
        """Until the kernel knows who is there."""
        SOCKET.write_text("dummy_udc.0\n")
        self.until(lambda: any(file.read_text() == "SIM001\n" for file in DEVICES.glob("*/serial")), self.sim, "SIM001")

    def test_a_camera_is_back_each_time_it_is_plugged_in_again(self):
        daemon = self.daemon(320, 240, CAMERA.format(number=1, format="Mono8", gain=6),
                             CAMERA.format(number=2, format="Mono10p", gain=0))
        self.said(daemon, "of controller dummy_hcd.0: cameras send 0.8 MB/s (cam1 0.8) of 400 MB/s")
        self.said(daemon, "camera cam1: started driver=aravis device=Usb3 exposure=400us")
        self.unplug_again_and_again(daemon, ROUNDS, lambda: SOCKET.write_text("\n"),
                                    self.plug_in)


class OneController(Unplugging):
    def setUp(self):
        super().setUp()
        self.sim = self.desk.start("mocap-sim", "--usb3", "--one-controller", "--serial-prefix", "ONE", "--ring", 2,
                                   "--size", 320, 240, "--loop-images", 4)
        self.said(self.sim, "camera cam2: plugged in")
        self.until(lambda: sum(file.read_text().startswith("ONE") for file in DEVICES.glob("*/serial")) == 2, self.sim,
                   "two cameras")

    def cameras(self, rate_hz):
        return [CAMERA.format(number=number, format="Mono8", gain=0).replace("SIM", "ONE")
                .replace("rate_hz = 10", f"rate_hz = {rate_hz}") for number in (1, 2)]

    def test_two_cameras_share_it_and_are_told_what_it_gives_and_when_that_is_too_little(self):
        daemon = self.daemon(320, 240, *self.cameras(10))
        self.said(daemon, "of controller vhci_hcd.0: cameras send 1.5 MB/s (cam1 0.8 + cam2 0.8) of 40 MB/s")
        for name in ("cam1", "cam2"):
            self.said(daemon, f"camera {name}: streaming")
        cameras = self.health()
        daemon.send(signal.SIGTERM)
        daemon.wait(LIMIT_S)
        listed = self.desk.run("mocapctl", "cameras", "list")
        greedy = self.daemon(320, 240, *self.cameras(300))
        self.said(greedy, "cameras send 46.1 MB/s (cam1 23.0 + cam2 23.0) of 40 MB/s that it gives; plug a camera into "
                          "another controller")

        for name, camera in cameras.items():
            self.assertEqual((camera["phase"], camera["failed_frames"]), ("streaming", 0), name)
        self.assertIn("of controller vhci_hcd.0 gives 40 MB/s, shared by ONE", listed.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
