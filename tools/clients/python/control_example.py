"""Lists the health of the cameras, or starts or stops the capture. usage: control_example.py [start|stop|status] [ENDPOINT [SERVER_KEY SECRET_KEY]]"""

import sys

from mocap_client import Control, ControlError

what, endpoint, server_key, secret_key = (sys.argv[1:] + ["status", "tcp://127.0.0.1:5571", None, None][len(sys.argv) - 1:])[:4]
try:
    with Control(endpoint, server_key=server_key, secret_key=secret_key) as control:
        if what != "status":
            print(control.start_capture() if what == "start" else control.stop_capture())
        status = control.status()
        print(f"{status.producer}, capture {'runs' if status.capturing else 'is stopped'}, you are {status.role}")
        for camera in status.health.cameras:
            print(f"{camera.name}: phase {camera.phase}, {camera.rate_hz:.1f} Hz, {camera.frames} frames {camera.last_error}")
except (ControlError, ValueError) as fault:
    sys.exit(f"control_example: {fault}")
