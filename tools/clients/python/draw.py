#!/usr/bin/python3
"""Draws a feed as an SVG picture: skeletons, labelled markers, and the trails of the markers.

usage: draw.py [ENDPOINT] [--seconds S] [--poses N] [--labels] [-o FILE]

  ENDPOINT      the feed; default tcp://127.0.0.1:5570
  --seconds S   how long to record; default 3
  --poses N     how many poses to draw, evenly spaced in time; default 5
  --labels      write the markers' labels beside the last pose
  -o FILE       default skeleton.svg

example: build/release/bin/mocapd --config config/synthetic.toml &
         PYTHONPATH=build/release/python /usr/bin/python3 tools/clients/python/draw.py --labels -o skeleton.svg
"""

import argparse
import math
import sys
import time

from mocap_client import Client

WIDTH_PX, HEIGHT_PX, MARGIN_PX = 960, 480, 40
VIEW_RAD = math.radians(20)  # rotation of the view about the vertical axis
TILT_RAD = math.radians(12)  # downward tilt of the view
BONE, MARKER, TRAIL, FLOOR, INK = "#2f6fb0", "#e4572e", "#e4b49c", "#d8dde3", "#3a4048"
PALETTE = (BONE, "#3c8d53")


def project(point, turn):
    """Projects a world point (m, z up) to the picture plane (m, y up) by parallel projection."""
    x, y, z = (float(value) for value in point)
    across = x * math.cos(turn) + y * math.sin(turn)
    deep = -x * math.sin(turn) + y * math.cos(turn)
    return across, z * math.cos(TILT_RAD) + deep * math.sin(TILT_RAD)


def watch(endpoint, seconds):
    """Returns the frames with at least one skeleton, and the reason if there are none."""
    frames, reason = [], ""
    with Client(endpoint, keep="all") as client:
        patience = time.monotonic() + 10.0
        end = None
        while time.monotonic() < (end or patience):
            frame = client.wait(0.5)
            if frame is None:
                reason = client.diagnose()[1]
                continue
            if any(len(subject.bones) for subject in frame.subjects.values()):
                end = end or time.monotonic() + seconds
                frames.append(frame)
    return frames, reason


class Picture:
    def __init__(self, points):
        xs, ys = [p[0] for p in points], [p[1] for p in points]
        self.left, self.top = min(xs), max(ys)
        width, height = max(max(xs) - self.left, 0.1), max(self.top - min(ys), 0.1)
        self.scale = min((WIDTH_PX - 2 * MARGIN_PX) / width, (HEIGHT_PX - 2 * MARGIN_PX) / height)
        self.shift = (WIDTH_PX - self.scale * width) / 2
        self.parts = []

    def at(self, point):
        return self.shift + (point[0] - self.left) * self.scale, MARGIN_PX + (self.top - point[1]) * self.scale

    def line(self, points, colour, width, opacity=1.0):
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(self.at, points))
        self.parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}" '
                          f'stroke-linecap="round" stroke-linejoin="round" opacity="{opacity:.2f}"/>')

    def dot(self, point, radius, colour, opacity=1.0):
        x, y = self.at(point)
        self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="{colour}" opacity="{opacity:.2f}"/>')

    def text(self, point, words, right):
        x, y = self.at(point)
        anchor = "start" if right else "end"
        self.parts.append(f'<text x="{x + (9 if right else -9):.1f}" y="{y + 3:.1f}" text-anchor="{anchor}">{words}</text>')

    def svg(self):
        body = "\n".join(self.parts)
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH_PX} {HEIGHT_PX}" font-family="sans-serif" '
                f'font-size="10" fill="{INK}">\n<rect width="{WIDTH_PX}" height="{HEIGHT_PX}" fill="#ffffff"/>\n{body}\n</svg>\n')


def seen(subject):
    """Indices of the markers that have a position."""
    return [i for i in range(len(subject.markers)) if subject.markers.states[i] in (2, 3)]


def heading(frames):
    """The view angle for which the first subject moves across the picture."""
    roots = [next(s for s in f.subjects.values() if len(s.bones)).bones.positions[0] for f in (frames[0], frames[-1])]
    along = roots[1] - roots[0]
    return math.atan2(float(along[1]), float(along[0])) + VIEW_RAD


def draw(frames, poses, labels):
    turn = heading(frames)
    chosen = [frames[round(i * (len(frames) - 1) / max(poses - 1, 1))] for i in range(poses)]
    points = [project(p, turn) for f in frames for s in f.subjects.values() for p in s.bones.positions]
    points += [project((p[0], p[1], 0.0), turn) for f in (frames[0], frames[-1]) for s in f.subjects.values() for p in s.bones.positions]
    picture = Picture(points)
    low_x, high_x = min(p[0] for p in points), max(p[0] for p in points)
    floor_y = min(p[1] for p in points)
    picture.line([(low_x - 0.3, floor_y), (high_x + 0.3, floor_y)], FLOOR, 6)
    for name in frames[-1].subjects:
        for marker in range(len(frames[-1].subjects[name].markers)):
            trail = [project(f.subjects[name].markers.positions[marker], turn) for f in frames
                     if name in f.subjects and marker in seen(f.subjects[name])]
            if len(trail) > 1:
                picture.line(trail, TRAIL, 0.8, 0.7)
    for number, frame in enumerate(chosen):
        opacity = 0.25 + 0.75 * (number + 1) / len(chosen)
        last = number == len(chosen) - 1
        for index, subject in enumerate(frame.subjects.values()):
            bones = subject.bones
            for child, parent in enumerate(bones.parents):
                if parent >= 0:
                    ends = [project(bones.positions[i], turn) for i in (parent, child)]
                    picture.line(ends, PALETTE[index % len(PALETTE)], 4 if last else 3, opacity)
            middle = project(bones.positions[0], turn)[0]
            for marker in seen(subject):
                at = project(subject.markers.positions[marker], turn)
                picture.dot(at, 3.2 if last else 2.2, MARKER, opacity)
                if labels and last:
                    picture.text(at, subject.markers.names[marker], at[0] >= middle)
    return picture.svg()


def main():
    options = argparse.ArgumentParser(usage=__doc__, add_help=False)
    options.add_argument("endpoint", nargs="?", default="tcp://127.0.0.1:5570")
    options.add_argument("--seconds", type=float, default=3.0)
    options.add_argument("--poses", type=int, default=5)
    options.add_argument("--labels", action="store_true")
    options.add_argument("-o", dest="file", default="skeleton.svg")
    options.add_argument("-h", "--help", action="store_true")
    chosen = options.parse_args()
    if chosen.help:
        print(__doc__)
        return 0
    frames, reason = watch(chosen.endpoint, chosen.seconds)
    if not frames:
        print(f"draw: no skeleton arrived from {chosen.endpoint}: {reason}", file=sys.stderr)
        return 69
    with open(chosen.file, "w", encoding="utf-8") as file:
        file.write(draw(frames, max(chosen.poses, 1), chosen.labels))
    print(f"draw: {len(frames)} frames, {len(frames[-1].subjects)} subject(s), written to {chosen.file}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
