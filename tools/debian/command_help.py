"""Reads the commands of a program and their options from --help, which is the only place that lists them."""

import dataclasses
import pathlib
import re
import subprocess

# Placeholders of values that may be paths: FILE, FILE.toml, OLD.toml, KEY|FILE, DIR, FOLDER, and the default of texts, TEXT.
_PATH = re.compile(r"FILE|DIR|FOLDER|\bOUT\b|\.toml\b|TEXT")


@dataclasses.dataclass(frozen=True)
class Option:
    names: tuple  # "-h", "--help"
    value: str  # the placeholder of its value; empty: a flag
    words: tuple  # the values to choose from; empty: any value
    summary: str

    @property
    def takes_path(self):
        return not self.words and bool(_PATH.search(self.value))


@dataclasses.dataclass(frozen=True)
class Command:
    words: tuple  # the program and its subcommands: "mocapctl", "keys", "new"
    summary: str  # one line, from the help of the command above
    options: tuple
    commands: tuple  # its subcommands

    def all(self):
        """The command and all commands below it."""
        yield self
        for command in self.commands:
            yield from command.all()

    @property
    def name(self):
        return self.words[-1]


def _entries(block):
    """The entries of a list of the help text, "  NAME  SUMMARY" with further lines indented, as pairs (NAME, SUMMARY)."""
    found = []
    for line in block.splitlines():
        if re.match(r"  \S", line):
            name, *summary = re.split(r"\s{2,}", line.strip(), maxsplit=1)
            # An option's own column may be too narrow: then one space, or a new line, separates the summary.
            found.append([name, " ".join(summary)])
        elif line.strip() and found:
            found[-1][1] = f"{found[-1][1]} {line.strip()}".strip()
    return found


def _block(text, heading):
    """The indented lines below each line `heading`, a pattern."""
    return "".join(re.findall(rf"^(?:{heading})\n\n?((?:  .*\n?)+)", text, re.MULTILINE))


def _option(name, summary):
    """An Option of the entry "-h,--help" or "--mode TEXT:{a,b} [a] Excludes: --all"; None if the entry is no option."""
    names, _, value = name.partition(" ")
    if not names.startswith("-"):
        return None
    value = re.sub(r"\s*(Excludes|Needs):.*| REQUIRED|\s*\(Env:\S*\)", "", value).strip()
    choices = re.search(r"\{([^}]*)\}", value)
    words = tuple(choices.group(1).split(",")) if choices else ()
    return Option(tuple(names.split(",")), value, words, summary)


def _subcommands(text):
    """The pairs (name, summary) of the subcommands, as CLI11 or run_command lists them."""
    return [entry for entry in _entries(_block(text, r"Subcommands:|usage: [\w -]+ COMMAND.*")) if re.match(r"[a-z]", entry[0])]


def help_text(program, words):
    """What `program`, a path, prints for the subcommand `words` and --help."""
    ended = subprocess.run([program, *words, "--help"], capture_output=True, text=True)
    if ended.returncode != 0:
        raise SystemExit(f"'{program.name} {' '.join(words)} --help' ended with {ended.returncode}: {ended.stderr.strip()}")
    return ended.stdout


def _read(program, words, summary):
    text = help_text(program, words[1:])
    listed = text.partition("\nexamples:")[0]
    # Options stand below "Options:" and below the headings of groups; subcommands below "Subcommands:".
    options = tuple(filter(None, (_option(*entry) for entry in _entries(_block(listed, r"(?!Subcommands:|Positionals:)\S.*:")))))
    commands = tuple(_read(program, (*words, name), said) for name, said in _subcommands(listed))
    return Command(words, summary or _summary(text, program.name), options, commands)


def _summary(text, name):
    """The first sentence above "Usage:", or the program's name where there is none."""
    about = " ".join(re.split(r"^[Uu]sage:", text, maxsplit=1, flags=re.MULTILINE)[0].split())
    return re.sub(rf"^{re.escape(name)}:\s*", "", about).partition(". ")[0].rstrip(".") or name


def read_commands(program):
    """The Command of the program at this path, with all its subcommands."""
    program = pathlib.Path(program).resolve()
    return _read(program, (program.name,), "")


def programs_in(folder):
    """The Commands of all programs in the folder, by name."""
    return [read_commands(path) for path in sorted(pathlib.Path(folder).iterdir()) if path.is_file()]
