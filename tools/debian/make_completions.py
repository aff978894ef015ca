#!/usr/bin/python3
"""Writes the completions of all programs in a folder for bash, zsh and fish. The commands, options and their choices come from
--help alone.

usage: make_completions.py PROGRAMS SHARE

  PROGRAMS   the folder with the programs, and with nothing else
  SHARE      the folder in which the shells search, such as /usr/share: bash-completion/completions/NAME,
             zsh/vendor-completions/_NAME, fish/vendor_completions.d/NAME.fish

examples:
  make_completions.py /usr/bin.of.the.package debian/tmp/usr/share
  tools/debian/make_completions.py build/release/bin ~/.local/share
"""

import pathlib
import re
import shlex
import sys

from command_help import programs_in


def _path_of(command):
    """The subcommand as the scripts keep it: "" for the program itself, otherwise " keys new"."""
    return "".join(f" {word}" for word in command.words[1:])


def _identifier(command):
    return "_" + re.sub(r"\W", "_", "__".join(command.words))


def _patterns(texts):
    """A list of patterns of `case` in bash, each quoted; of none, a pattern that fits nothing."""
    return "|".join(map(shlex.quote, texts)) or "/"


# --- bash -------------------------------------------------------------------------------------------------------------

_BASH = """\
# bash completion of {program}, made from its --help
{function}_takes_value() {{ # COMMAND OPTION
  case "$1" in
    {values}) return 0 ;;
  esac
  return 1
}}
{function}() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}} command= last= word
  # bash has = as a word of its own.
  [[ $current == = ]] && current=
  [[ $before == = ]] && before=${{COMP_WORDS[COMP_CWORD - 2]}}
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    if ! {function}_takes_value "$command $last"; then
      case "$command $word" in
        {commands}) command+=" $word" ;;
      esac
    fi
    last=$word
  done
  local words=
  case "$command $before" in
{choices}    *)
      {function}_takes_value "$command $before" && return
      case "$command" in
{words}      esac ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
}}
complete -o bashdefault -o default -F {function} {program}
"""


def _bash_choices(command, option):
    names = _patterns(f"{_path_of(command)} {name}" for name in option.names)
    return f"    {names}) words={shlex.quote(' '.join(option.words))} ;;\n"


def _bash_words(command):
    proposed = [child.name for child in command.commands] + [option.names[-1] for option in command.options]
    return f"        {shlex.quote(_path_of(command))}) words={shlex.quote(' '.join(proposed))} ;;\n"


def bash(program):
    """The bash script of one program. Without a proposal, bash completes the names of files."""
    commands = list(program.all())
    options = [(command, option) for command in commands for option in command.options]
    return _BASH.format(
        program=program.name, function=_identifier(program),
        values=_patterns(f"{_path_of(command)} {name}" for command, option in options if option.value for name in option.names),
        commands=_patterns(map(_path_of, commands[1:])),
        choices="".join(_bash_choices(command, option) for command, option in options if option.words),
        words="".join(map(_bash_words, commands)))


# --- zsh --------------------------------------------------------------------------------------------------------------


def _zsh_text(text):
    """Text inside of a specification of _arguments."""
    return re.sub(r"([\[\]:\\])", r"\\\1", text)


def _zsh_option(option):
    """The specifications of one option, quoted; one name excludes the others."""
    action = f"({' '.join(option.words)})" if option.words else "_files" if option.takes_path else " "
    value = f":{_zsh_text(option.value)}:{action}" if option.value else ""
    others = f"({' '.join(option.names)})"
    return [shlex.quote(f"{others}{name}[{_zsh_text(option.summary)}]{value}") for name in option.names]


def _zsh_function(command):
    specifications = [text for option in command.options for text in _zsh_option(option)]
    if not command.commands:
        lines = " \\\n    ".join(["_arguments", *specifications, "'*:file:_files'"])
        return f"{_identifier(command)}() {{\n  {lines}\n}}\n"
    listed = " ".join(shlex.quote(f"{child.name}:{child.summary}") for child in command.commands)
    lines = " \\\n    ".join(["_arguments -C", *specifications, "'1:command:->command'", "'*::argument:->rest'"])
    cases = "".join(f"      {child.name}) {_identifier(child)} ;;\n" for child in command.commands)
    return (f"{_identifier(command)}() {{\n  local state line\n  {lines}\n  case $state in\n"
            f"    command) local -a commands=({listed}); _describe command commands ;;\n"
            f"    rest) case $words[1] in\n{cases}    esac ;;\n  esac\n}}\n")


def zsh(program):
    """The zsh script of one program: a function for each command."""
    functions = "".join(_zsh_function(command) for command in program.all())
    return f"#compdef {program.name}\n# zsh completion of {program.name}, made from its --help\n{functions}{_identifier(program)} \"$@\"\n"


# --- fish -------------------------------------------------------------------------------------------------------------


def _fish_text(text):
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def _fish_option(option):
    """The arguments of `complete` for one option."""
    names = " ".join(f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}" for name in option.names)
    value = f" -x -a {_fish_text(' '.join(option.words))}" if option.words else " -r" if option.value else ""
    files = " -F" if option.takes_path else ""
    return f"{names}{value}{files} -d {_fish_text(option.summary)}"


def fish(program):
    """The fish script of one program. A function names the command that the words so far have reached."""
    function = _identifier(program)
    known = " ".join(_fish_text(_path_of(command)) for command in program.all() if _path_of(command))
    lines = [f"# fish completion of {program.name}, made from its --help", f"function {function}", "    set -l command ''",
             "    for word in (commandline -opc)[2..]"]
    if known:
        lines += [f"        if contains -- \"$command $word\" {known}", "            set command \"$command $word\"", "        end"]
    lines += ["    end", "    test \"$command\" = \"$argv[1]\"", "end"]
    for command in program.all():
        here = f"complete -c {program.name} -n {_fish_text(f'{function} {_fish_text(_path_of(command))}')}"
        lines += [f"{here} -f -a {child.name} -d {_fish_text(child.summary)}" for child in command.commands]
        lines += [f"{here} {_fish_option(option)}" for option in command.options]
    return "\n".join(lines) + "\n"


# ----------------------------------------------------------------------------------------------------------------------

FILES = {  # the place of each shell's script
    "bash-completion/completions/{}": bash,
    "zsh/vendor-completions/_{}": zsh,
    "fish/vendor_completions.d/{}.fish": fish,
}


def main(arguments):
    if "--help" in arguments or "-h" in arguments:
        print(__doc__)
        return 0
    if len(arguments) != 2:
        print(f"make_completions: expected PROGRAMS and SHARE, got {len(arguments)} arguments; see --help", file=sys.stderr)
        return 64
    programs = programs_in(arguments[0])
    for place, script_of in FILES.items():
        for program in programs:
            path = pathlib.Path(arguments[1], place.format(program.name))
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(script_of(program))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
