"""USB3 Vision on a real kernel: two simulated cameras on two host controllers of dummy_hcd, and two on the single controller
of USB/IP. Run by guest_vm.sh usb3=2 and by guest_vm.sh usb3=1 usbip=2; the hubs of USB/IP slow the search for cameras down."""

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
        self.wait_for_log(self.sim, "camera cam2: plugged in")

    def plug_in(self):
        """Connects cam1 and waits until the kernel has enumerated it."""
        SOCKET.write_text("dummy_udc.0\n")
        self.until(lambda: any(file.read_text() == "SIM001\n" for file in DEVICES.glob("*/serial")), self.sim, "SIM001")

    def test_a_camera_comes_back_each_time_it_is_plugged_in(self):
        daemon = self.daemon(320, 240, CAMERA.format(number=1, format="Mono8", gain=6),
                             CAMERA.format(number=2, format="Mono10p", gain=0))
        self.wait_for_log(daemon, "of controller dummy_hcd.0: cameras send 0.8 MB/s (cam1 0.8) of 400 MB/s")
        self.wait_for_log(daemon, "camera cam1: started driver=aravis device=Usb3 exposure=400us")
        self.unplug_again_and_again(daemon, ROUNDS, lambda: SOCKET.write_text("\n"),
                                    self.plug_in)


class OneController(Unplugging):
    def setUp(self):
        super().setUp()
        self.sim = self.desk.start("mocap-sim", "--usb3", "--one-controller", "--serial-prefix", "ONE", "--ring", 2,
                                   "--size", 320, 240, "--loop-images", 4)
        self.wait_for_log(self.sim, "camera cam2: plugged in")
        self.until(lambda: sum(file.read_text().startswith("ONE") for file in DEVICES.glob("*/serial")) == 2, self.sim,
                   "two cameras")

    def cameras(self, rate_hz):
        return [CAMERA.format(number=number, format="Mono8", gain=0).replace("SIM", "ONE")
                .replace("rate_hz = 10", f"rate_hz = {rate_hz}") for number in (1, 2)]

    def test_two_cameras_share_the_bus_and_its_bandwidth_is_reported(self):
        daemon = self.daemon(320, 240, *self.cameras(10))
        self.wait_for_log(daemon, "of controller vhci_hcd.0: cameras send 1.5 MB/s (cam1 0.8 + cam2 0.8) of 40 MB/s")
        for name in ("cam1", "cam2"):
            self.wait_for_log(daemon, f"camera {name}: streaming")
        cameras = self.health()
        daemon.send(signal.SIGTERM)
        daemon.wait(LIMIT_S)
        listed = self.desk.run("mocapctl", "cameras", "list")
        greedy = self.daemon(320, 240, *self.cameras(300))
        self.wait_for_log(greedy, "cameras send 46.1 MB/s (cam1 23.0 + cam2 23.0) of 40 MB/s that it gives; plug a camera into "
                          "another controller")

        for name, camera in cameras.items():
            self.assertEqual((camera["phase"], camera["failed_frames"]), ("streaming", 0), name)
        self.assertIn("of controller vhci_hcd.0 gives 40 MB/s, shared by ONE", listed.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
