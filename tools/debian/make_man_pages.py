#!/usr/bin/python3
"""Writes a man page for each program in a folder and for each of its subcommands, from their --help, with help2man.

usage: make_man_pages.py PROGRAMS MAN1

  PROGRAMS   the folder with the programs, and with nothing else
  MAN1       the folder of the pages: mocapctl.1, mocapctl-keys-new.1, ...

example:
  make_man_pages.py debian/tmp/usr/bin debian/tmp/usr/share/man/man1
"""

import concurrent.futures
import pathlib
import re
import subprocess
import sys
import tempfile

from command_help import help_text, programs_in


def gnu_help(text):
    """The help text without its examples in the layout that help2man reads: a capital Usage:, and ", " between names."""
    text = text.partition("\nexamples:\n")[0] + "\n"
    text = re.sub(r"^usage: ([\w -]+ COMMAND \[options\]).*$", r"Usage: \1\n\nCommands:", text, flags=re.MULTILINE)
    return re.sub(r"^(  -\w),(--\S+) ?", r"\1, \2", text, flags=re.MULTILINE)


def page_name(command):
    return "-".join(command.words)


def _roff(lines):
    """Lines of text as they are."""
    quoted = "\n".join(re.sub(r"^([.'])", r"\\&\1", line.replace("\\", r"\e").replace("-", r"\-")) for line in lines)
    return f".nf\n{quoted}\n.fi\n"


def _examples(text):
    """The examples of the help text, and the paragraphs below them, as sections for help2man --include."""
    examples, _, rest = text.partition("\nexamples:\n")[2].partition("\n\n")
    sections = f"[EXAMPLES]\n{_roff(examples.rstrip().splitlines())}\n" if examples else ""
    codes = re.match(r"exit codes: (.*)", rest, re.DOTALL)
    return sections + (f"[EXIT STATUS]\n{codes.group(1).strip()}\n\n" if codes else "")


def _see_also(program, command):
    """The pages directly above and below a command, as a section for help2man --include."""
    near = [other for other in program.all() if other.words[:-1] == command.words or other.words == command.words[:-1]]
    pages = ",\n".join(f"{page_name(other)}(1)".replace("-", r"\-") for other in near)
    return f"[SEE ALSO]\n{pages}\n" if pages else ""


def write_page(folder, program, command, man1):
    """Writes the page of one command of the program in `folder`."""
    path = pathlib.Path(folder, program.name).resolve()
    text = help_text(path, command.words[1:])
    version = subprocess.run([path, "--version"], capture_output=True, text=True, check=True).stdout.split()[1]
    with tempfile.TemporaryDirectory() as work:
        (pathlib.Path(work) / "help").write_text(gnu_help(text))
        (pathlib.Path(work) / "include").write_text(_examples(text) + _see_also(program, command))
        reader = pathlib.Path(work) / page_name(command)  # help2man runs a program, whose name becomes the page's
        reader.write_text(f"#!/bin/sh\ncat '{work}/help'\n")
        reader.chmod(0o755)
        ended = subprocess.run(
            ["help2man", "--no-info", "--section=1", "--manual=mocapd", "--source=mocapd", f"--version-string={version}",
             f"--name={command.summary}", f"--include={work}/include",
             f"--output={pathlib.Path(man1, page_name(command) + '.1')}", reader],
            capture_output=True, text=True)
    if ended.returncode != 0:
        raise SystemExit(f"make_man_pages: help2man failed for '{' '.join(command.words)}': {ended.stderr.strip()}")


def main(arguments):
    if "--help" in arguments or "-h" in arguments:
        print(__doc__)
        return 0
    if len(arguments) != 2:
        print(f"make_man_pages: expected PROGRAMS and MAN1, got {len(arguments)} arguments; see --help", file=sys.stderr)
        return 64
    folder, man1 = arguments
    pathlib.Path(man1).mkdir(parents=True, exist_ok=True)
    with concurrent.futures.ThreadPoolExecutor() as threads:
        pages = [threads.submit(write_page, folder, program, command, man1)
                 for program in programs_in(folder) for command in program.all()]
    for page in pages:
        page.result()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
