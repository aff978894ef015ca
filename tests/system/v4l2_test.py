"""V4L2 on a real kernel: two cameras of the test driver vivid. Run by guest_vm.sh vivid=2."""

import fcntl
import os
import struct
import unittest

from unplugging import Unplugging

CAMERA = """
[[camera]]
name = "cam{number}"
driver = "v4l2"
bus = "platform:vivid-00{number}"
pixel_format = "GREY"
width_px = 320
height_px = 180
rate_hz = 10
"""

ROUNDS = int(os.environ.get("MOCAP_REPLUG_ROUNDS") or 10)

# Constants of linux/videodev2.h. The controls of vivid are found by name: their numbers are private to the driver.
VIDIOC_QUERYCTRL = 0xC0445624
VIDIOC_S_CTRL = 0xC008561C
NEXT = 0x80000000


def set_control(device, name, value):
    handle = os.open(device, os.O_RDWR | os.O_CLOEXEC)
    try:
        number = 0
        while True:
            query = bytearray(struct.pack("<II32s7I", number | NEXT, 0, b"", *[0] * 7))
            fcntl.ioctl(handle, VIDIOC_QUERYCTRL, query)
            number, _, found = struct.unpack_from("<II32s", query)
            if found.rstrip(b"\0").decode() == name:
                fcntl.ioctl(handle, VIDIOC_S_CTRL, struct.pack("<Ii", number, value))
                return
    finally:
        os.close(handle)


class V4l2(Unplugging):
    def test_a_camera_comes_back_each_time_it_is_plugged_in(self):
        daemon = self.daemon(320, 180, CAMERA.format(number=0).replace("cam0", "cam1"),
                             CAMERA.format(number=1).replace("cam1", "cam2"))
        # vivid comes back when its last reader has closed the device.
        self.unplug_again_and_again(daemon, ROUNDS, lambda: set_control("/dev/video0", "Disconnect", 1), lambda: None)


if __name__ == "__main__":
    unittest.main(verbosity=2)
