"""The report of a soak: report.txt, and a plot over the time for memory, latency and losses."""

import html
import math
import os
import platform
import statistics
import subprocess

WIDTH, HEIGHT, MARGIN = 900, 240, 50
COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd")


def plot(path, title, unit, series, faults, logarithmic=False):
    """`series`: name to [(s, value or None)]; `faults`: [(s, name)], drawn as lines."""
    scale = (lambda value: math.log10(max(value, 1e-1)) + 1) if logarithmic else (lambda value: value)
    values = [scale(value) for points in series.values() for _, value in points if value is not None] or [1]
    end = max([at for points in series.values() for at, _ in points] or [1])
    top = max(*values, 1e-9) * 1.05
    place = lambda at, value: (MARGIN + at / end * (WIDTH - 2 * MARGIN), HEIGHT - MARGIN / 2 - scale(value) / top * (HEIGHT - 1.5 * MARGIN))
    most = 10 ** (top / 1.05 - 1) if logarithmic else top / 1.05
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="11">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>', f'<text x="{MARGIN}" y="14">{title}, {unit}'
           f'{", logarithmic" if logarithmic else ""}; at most {most:.4g}; {end / 60:.1f} min</text>']
    for at, name in faults:
        x = place(at, 0 if not logarithmic else 0.1)[0]
        out.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{MARGIN / 2}" y2="{HEIGHT - MARGIN / 2}" stroke="#ccc"><title>{html.escape(name)}'
                   f'</title></line>')
    for colour, (index, (name, points)) in zip(COLOURS, enumerate(series.items())):
        pieces, piece = [], []
        for at, value in [*points, (0, None)]:
            if value is None:
                pieces += [piece] if piece else []
                piece = []
            else:
                piece.append("{:.1f},{:.1f}".format(*place(at, value)))
        out += [f'<polyline points="{" ".join(piece)}" fill="none" stroke="{colour}"/>' for piece in pieces]
        out.append(f'<text x="{WIDTH - 200}" y="{14 + 14 * index}" fill="{colour}">{html.escape(name)}</text>')
    path.write_text("\n".join([*out, "</svg>", ""]))


def median_of(values):
    known = [value for value in values if value is not None]
    return statistics.median(known) if known else float("nan")


def write(folder, soak):
    """Writes all files of the report, and returns the text."""
    faults = [(each.began_s, each.name) for each in soak.faults]
    plot(folder / "memory.svg", "private memory", "MB",
         {name: [(at, row[name]) for at, row in soak.samples] for name in ("mocapd", "page", "bridge")}, faults)
    plot(folder / "latency.svg", "exposure to subscriber", "ms",
         {name: [(at, row[name]) for at, row in soak.samples] for name in ("p50_ms", "p99_ms")}, faults, logarithmic=True)
    plot(folder / "losses.svg", "snapshots that subscribers missed, and images that cameras lost", "in a second",
         {name: [(at, row[name]) for at, row in soak.samples] for name in ("missed", "missing_images")}, faults)
    calm = [row for at, row in soak.samples if not soak.is_explained(at)]
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False).stdout.strip()
    lines = [f"soak of {soak.samples[-1][0] / 60:.1f} minutes, seed {soak.seed}, commit {commit or 'unknown'}",
             f"{platform.node()}: {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}", "",
             f"{soak.studio.cameras} GigE cameras at {soak.studio.rate_hz} Hz; {soak.steady.count} subscribers, {soak.stalling.count} that "
             f"stall, a page, a bridge",
             f"received: {soak.steady.line['received']} snapshots by subscribers, {soak.page.drawn} by the page, {soak.receiver.packets} "
             f"packets of the bridge",
             f"latency from exposure to subscriber without a fault: {median_of(r['p50_ms'] for r in calm):.1f} ms p50, "
             f"{median_of(r['p99_ms'] for r in calm):.1f} ms p99 of a second (medians of all seconds)",
             f"missed by subscribers: {sum(r['missed'] for r in calm)} snapshots without a fault, "
             f"{sum(r['missed'] for _, r in soak.samples)} in all",
             f"lost by cameras: {sum(r['missing_images'] for r in calm)} images without a fault, "
             f"{sum(r['missing_images'] for _, r in soak.samples)} in all",
             f"takes: {soak.takes.whole} whole, {soak.takes.repaired} cut off by a kill and repaired, {soak.takes.told} ended early "
             "with a reason",
             "", "fault                 number  recovered after s: median  most"]
    for name in sorted({each.name for each in soak.faults}):
        took = [each.recovered_s - each.ended_s for each in soak.faults if each.name == name and each.recovered_s is not None]
        count = sum(each.name == name for each in soak.faults)
        lines.append(f"{name:22}{count:6}{median_of(took):27.1f}{max(took, default=math.nan):6.1f}")
    lines += ["", "private memory, MB     60 s after its start  at the most then  growth an hour (lives of 5 minutes or more)"]
    for life in soak.lives:
        if life.settled_mb is not None:
            growth = f"{life.growth_an_hour():.1f}" if life.growth_an_hour() is not None else "-"
            lines.append(f"{life.name:22}{life.settled_mb:21.1f}{life.most_mb:18.1f}  {growth}")
    lines += ["", *(f"VIOLATED: {each}" for each in soak.violations), "" if soak.violations else "all invariants held", ""]
    text = "\n".join(lines)
    (folder / "report.txt").write_text(text)
    return text
