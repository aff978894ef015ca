#!/usr/bin/python3
"""Checks that the target of every relative link and picture in the Markdown files exists, and that every #anchor is a heading.

usage: links.py [FOLDER]      prints each fault as file:line: fault; exit code 1 if there is any
"""

import pathlib
import re
import subprocess
import sys

PROJECT = pathlib.Path(__file__).parent.parent
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+\s+(.*)$", re.MULTILINE)


def anchor_of(heading):
    """The anchor that a Markdown page gives to a heading."""
    return re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", heading.strip().lower()))


def fault_of(page, target):
    """The fault of one link target on `page`, or None."""
    if re.match(r"[a-z]+:", target):
        return None  # an external link
    path, _, anchor = target.partition("#")
    file = page.parent / path if path else page
    if not file.exists():
        return f"'{target}' is not a file"
    if anchor and file.suffix == ".md" and anchor not in map(anchor_of, HEADING.findall(file.read_text(encoding="utf-8"))):
        return f"'{target}' is not a heading of {file.name}"
    return None


def faults_in(folder, pages):
    """Every fault of the Markdown files `pages` (relative to `folder`), as text."""
    faults = []
    for name in pages:
        page = folder / name
        in_code = False
        for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
            in_code ^= line.lstrip().startswith("```")
            if in_code:
                continue
            for target in LINK.findall(re.sub(r"`[^`]*`", "", line)):
                fault = fault_of(page, target)
                if fault:
                    faults.append(f"{name}:{number}: {fault}")
    return faults


def pages_of(folder):
    """The Markdown files that are tracked, or new and not ignored."""
    listed = subprocess.run(["git", "-C", folder, "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
                            capture_output=True, text=True, check=True).stdout.split("\n")
    return sorted(name for name in set(listed) if name and (folder / name).is_file())


def main():
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else PROJECT
    pages = pages_of(folder)
    faults = faults_in(folder, pages)
    print("\n".join(faults) if faults else f"links: all links of {len(pages)} pages have targets")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
