"""Measures mocap-web beside a real daemon at 120 Hz, on a machine that does nothing else, and prints the figures as JSON.

    tests/web/measure.py pages --pages 20 --seconds 600    # the cost of open pages, of which one is stopped
    tests/web/measure.py browser --seconds 1800            # a page in Chromium: first paint, age of what is drawn, memory

pages    feed_lost: snapshots that another subscriber of the daemon did not get; cpu_share: processor time of mocap-web for
         all pages together, as a share of one core; drawn_hz: snapshots that a page got each second, which acknowledges
         each one at the pace of a screen of 60 Hz.
browser  age_p95_ms: from the exposure until the page had drawn; heap_growth_bytes: memory of the page's objects at the end
         less that after five minutes, or at the start of a shorter run; collected before.
Needs build/release, the packages of `tools/setup.sh --tests`, and for `browser` Chromium. Exit code 77: one is missing."""

import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "system"))
from feed_client import Subscriber, snapshot_pb2  # noqa: E402
from harness import Desk, synthetic_volume  # noqa: E402
from web_test import Web, wait_until  # noqa: E402

RATE_HZ = 120
SCREEN_S = 1 / 60
SETTLE_S = 10  # identification, the first messages
TICKS_S = os.sysconf("SC_CLK_TCK")


def processor_s(process):
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_S


class OpenPage:
    """A page that shows the Stage: it acknowledges each snapshot at its next frame."""

    def __init__(self, web):
        self.drawn, self._ends = 0, False
        self._socket = web.open_page()
        self._socket.send({"subscribe": ["description", "snapshot", "health", "event"]})
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while not self._ends:
            snapshot = snapshot_pb2.Snapshot.FromString(self._socket.wait_for_topic("snapshot"))
            time.sleep(SCREEN_S - time.monotonic() % SCREEN_S)
            self._socket.send({"drawn": snapshot.number})
            self.drawn += 1

    def end(self):
        self._ends = True
        self._thread.join()
        self._socket.close()


def stopped_page(web):
    """A page that asked for everything and reads nothing, as in a debugger."""
    socket = web.open_page()
    socket.send({"subscribe": ["description", "snapshot", "health", "event", "sightings"]})
    return socket


def measure_pages(web, subscriber, count, seconds):
    before = processor_s(web.program.process)
    time.sleep(SETTLE_S)
    alone = (processor_s(web.program.process) - before) / SETTLE_S
    pages = [OpenPage(web) for _ in range(count - 1)]
    stopped = stopped_page(web)
    time.sleep(SETTLE_S)
    gaps, received = subscriber.gaps, len(subscriber.snapshots)
    drawn = sum(page.drawn for page in pages)
    before, began = processor_s(web.program.process), time.monotonic()
    time.sleep(seconds)
    took = time.monotonic() - began
    share = (processor_s(web.program.process) - before) / took - alone
    figures = {"pages": count, "seconds": round(took, 1), "sets": len(subscriber.snapshots) - received, "feed_lost": subscriber.gaps - gaps,
               "cpu_share": round(share, 4), "cpu_share_without_pages": round(alone, 4),
               "drawn_hz": round((sum(page.drawn for page in pages) - drawn) / took / len(pages), 1)}
    for page in pages:
        page.end()
    stopped.close()
    return figures


def at_share(sorted_values, share):
    return sorted_values[min(len(sorted_values) - 1, int(share * len(sorted_values)))]


def exposed_utc_ms(subscriber, number):
    snapshot = snapshot_pb2.Snapshot.FromString(subscriber.snapshots[number])
    return (snapshot.instants.exposed_at_ns + snapshot.utc_minus_host_ns) / 1e6


def measure_browser(web, subscriber, seconds):
    done = subprocess.run(["node", HERE / "measure_page.mjs", f"http://127.0.0.1:{web.port}", str(seconds)],
                          capture_output=True, text=True, check=False, timeout=seconds + 300)
    if done.returncode != 0:
        sys.exit(f"measure: {done.stderr}")
    said = json.loads(done.stdout)
    ages = sorted(at_ms - exposed_utc_ms(subscriber, number) for number, at_ms in said["drawn"] if number in subscriber.snapshots)
    heap = said["heap_bytes"]
    return {"seconds": seconds, "first_paint_ms": round(said["first_paint_ms"]), "drawn_hz": round(len(ages) / seconds, 1),
            "age_p50_ms": round(at_share(ages, 0.5), 1), "age_p95_ms": round(at_share(ages, 0.95), 1), "age_p99_ms": round(at_share(ages, 0.99), 1),
            "heap_growth_bytes": heap[-1] - heap[min(5, len(heap) - 2)], "heap_bytes": heap[-1], "feed_lost": subscriber.gaps}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("pages", "browser"))
    parser.add_argument("--pages", type=int, default=20, help="open pages, one of them stopped (20)")
    parser.add_argument("--seconds", type=int, default=60, help="length of the measurement, s (60)")
    arguments = parser.parse_args()
    if arguments.what == "browser" and shutil.which("node") is None:
        print("measure: Node.js is missing; run tools/setup.sh --tests", file=sys.stderr)
        sys.exit(77)
    with Desk() as desk:
        config = desk.write("mocapd.toml", synthetic_volume(desk.endpoint).replace("rate_hz = 30", f"rate_hz = {RATE_HZ}"))
        desk.start("mocapd", "--config", config)
        subscriber = Subscriber(desk.endpoint)
        web = Web(desk, desk.endpoint)
        wait_until(lambda: web.get("/readyz")[0] == 200, "the daemon's feed")
        if arguments.what == "pages":
            figures = measure_pages(web, subscriber, arguments.pages, arguments.seconds)
        else:
            figures = measure_browser(web, subscriber, arguments.seconds)
        subscriber.end()
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
