"""The faults of the soak. Each is a generator: it makes the fault, yields the seconds until its next step, and ends the fault."""

import contextlib
import os
import signal
import socket
import subprocess

BUSY = "import time; end = time.monotonic() + {seconds}\nwhile time.monotonic() < end: pass"


def camera_unplugged(studio, chance, _):
    name = f"camera{chance.randint(1, studio.cameras)}"
    studio.kill(name)
    yield chance.uniform(3, 12)
    studio.start(name)


def cable_pulled(studio, chance, _):
    subprocess.run(["ip", "link", "set", "cable0", "down"], check=True)
    yield chance.uniform(1, 6)
    subprocess.run(["ip", "link", "set", "cable0", "up"], check=True)


def subscribers_stall(_, chance, stalling):
    stalling.process.send_signal(signal.SIGSTOP)
    yield chance.uniform(5, 15)
    stalling.process.send_signal(signal.SIGCONT)


def daemon_killed(studio, chance, _):
    studio.kill("mocapd")
    yield chance.uniform(0, 3)
    studio.start("mocapd")


def daemon_stands_still(studio, chance, _):
    studio.programs["mocapd"].send_signal(signal.SIGSTOP)
    yield chance.uniform(0.5, 3)
    studio.programs["mocapd"].send_signal(signal.SIGCONT)


def page_killed(studio, chance, _):
    studio.kill("page")
    yield chance.uniform(0, 3)
    studio.start("page")


def bridge_killed(studio, chance, _):
    studio.kill("bridge")
    yield chance.uniform(0, 3)
    studio.start("bridge")


def disk_full(studio, chance, _):
    filler = studio.disk / "filler"
    with open(filler, "wb", buffering=0) as file, contextlib.suppress(OSError):
        while True:
            file.write(b"x" * 65536)
    yield chance.uniform(5, 10)
    filler.unlink()


def settings_changed(studio, chance, _):
    studio.threshold = chance.randint(50, 70)
    studio.write_config()
    studio.operator.order("reload", timeout_s=20)
    yield 1


def busy_machine(_, chance, __):
    seconds = chance.uniform(2, 6)
    programs = [subprocess.Popen(["/usr/bin/python3", "-c", BUSY.format(seconds=seconds)]) for _ in range(os.cpu_count())]
    yield seconds
    for program in programs:
        program.wait()


def nonsense(studio, chance, _):
    """Bytes of no protocol to each socket of daemon and page."""
    feed = int(studio.endpoint.rsplit(":", 1)[1])
    for port in (feed, feed + 1, studio.page_port) * 10:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 2) as peer:
            peer.sendall(chance.randbytes(20_000))
    yield 1


ALL = (camera_unplugged, cable_pulled, subscribers_stall, daemon_killed, daemon_stands_still, page_killed, bridge_killed, disk_full,
       settings_changed, busy_machine, nonsense)


def in_turn(chance):
    """All faults in a random order, again and again, so that a short run has many kinds."""
    while True:
        yield from chance.sample(ALL, len(ALL))
