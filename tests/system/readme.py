#!/usr/bin/python3
"""The commands and the code that a README shows, for tests that use them as printed.

usage: readme.py commands README            its commands in their order, one a line
       readme.py block LANGUAGE README      its first code block of this language

A command is a line of a code block without language, or a command line with arguments in the text. Comments are left out.
"""

import pathlib
import re
import sys
import textwrap

_CODE = re.compile(r"^ *```(?P<language>\w*)\n(?P<block>.*?)^ *```$|`(?P<inline>[^`]+)`", re.MULTILINE | re.DOTALL)
# `mocapd` alone, or `tools/clients`, is a name; with arguments, or as a script of tools/, it is a command.
_INLINE_COMMAND = re.compile(r"(mocapd|mocapctl|mocap-\w+|sudo|systemctl|apt|man)\s+\S|tools/\w+\.sh")


def block(text, language):
    """The first code block of the language, without the indentation of its list."""
    return next(textwrap.dedent(found["block"]) for found in _CODE.finditer(text) if found["language"] == language)


def _lines(code):
    """The commands of a code block."""
    lines = re.sub(r"\s*\\\n\s*", " ", code).splitlines()
    return filter(None, (re.sub(r"(^|\s)#.*", "", line).strip() for line in lines))


def commands(text):
    """All commands of the text, each once."""
    found = []
    for code in _CODE.finditer(text):
        if code["language"] == "":
            found += _lines(code["block"])
        elif code["inline"] and _INLINE_COMMAND.match(code["inline"]):
            found.append(" ".join(code["inline"].split()))
    return list(dict.fromkeys(found))


def main(arguments):
    match arguments:
        case ["commands", path]:
            print("\n".join(commands(pathlib.Path(path).read_text())))
        case ["block", language, path]:
            print(block(pathlib.Path(path).read_text(), language), end="")
        case _:
            print(__doc__, file=sys.stderr)
            return 64
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
