"""USB3 Vision on a real kernel: two simulated cameras on the host controllers of dummy_hcd. Run by guest_vm.sh usb3=2."""

import os
import pathlib
import unittest

from unplugging import Unplugging

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

ROUNDS = int(os.environ.get("MOCAP_REPLUG_ROUNDS") or 10)
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


if __name__ == "__main__":
    unittest.main(verbosity=2)
