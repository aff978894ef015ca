#!/usr/bin/python3
"""Writes a Unity .meta file for every file and folder of an unpacked UPM package.

usage: meta.py FOLDER          FOLDER contains package.json
       meta.py --guid PATH     prints the GUID of PATH, a path inside the package, for use in a scene

The GUID is the MD5 hash of the package's name and the path, so every build of the package has the same GUIDs, and scenes
that refer to its scripts survive an update. A file that is moved or renamed has another GUID.

example: meta.py --guid Runtime/MocapHumanoid.cs
"""

import hashlib
import pathlib
import sys

PACKAGE = "org.mocapd.unity"

# Importer of a file, and its settings, by the end of the file's name.
PLAIN = "  externalObjects: {}\n"
SCRIPT = PLAIN + "  serializedVersion: 2\n  defaultReferences: []\n  executionOrder: 0\n  icon: {instanceID: 0}\n"
IMPORTERS = {
    ".cs": ("MonoImporter", SCRIPT),
    ".asmdef": ("AssemblyDefinitionImporter", PLAIN),
    ".md": ("TextScriptImporter", PLAIN),
    ".unity": ("DefaultImporter", PLAIN),
    "package.json": ("PackageManifestImporter", PLAIN),
}

# Native libraries: the editor's operating system and the build target that load the library.
PLATFORMS = {".so": ("Linux", "Linux64"), ".dll": ("Windows", "Win64")}
TARGETS = ("Linux64", "OSXUniversal", "Win", "Win64")

END = "  userData: \n  assetBundleName: \n  assetBundleVariant: \n"


def guid_of(path):
    """The GUID of a path inside the package, 32 hexadecimal digits."""
    return hashlib.md5(f"{PACKAGE}/{pathlib.PurePosixPath(path)}".encode()).hexdigest()


def platform(kind, name, enabled, settings):
    """One entry of a native library's platform data."""
    return (f"  - first:\n      {kind}: {name}\n    second:\n      enabled: {int(enabled)}\n      settings:"
            + ("".join(f"\n        {key}: {value}" for key, value in settings.items()) if settings else " {}") + "\n")


def native_settings(suffix):
    """The settings of a 64-bit native library for one operating system; other platforms do not load it."""
    system, own = PLATFORMS[suffix]
    excluded = {"Exclude Editor": 0, **{f"Exclude {target}": int(target != own) for target in TARGETS}}
    text = PLAIN + ("  serializedVersion: 2\n  iconMap: {}\n  executionOrder: {}\n  defineConstraints: []\n  isPreloaded: 0\n"
                    "  isOverridable: 0\n  isExplicitlyReferenced: 0\n  validateReferences: 1\n  platformData:\n")
    text += platform("", "Any", False, excluded)
    text += platform("Any", "", False, {})
    text += platform("Editor", "Editor", True, {"CPU": "x86_64", "DefaultValueInitialized": "true", "OS": system})
    for target in TARGETS:
        text += platform("Standalone", target, target == own, {"CPU": "x86_64" if target == own else "None"})
    return text


def meta_of(path, is_folder):
    """The text of the .meta file of a path inside the package. Fails with ValueError if the kind of file is unknown."""
    head = f"fileFormatVersion: 2\nguid: {guid_of(path)}\n"
    if is_folder:
        return head + "folderAsset: yes\nDefaultImporter:\n" + PLAIN + END
    name = pathlib.PurePosixPath(path).name
    for suffix in PLATFORMS:
        if name.endswith(suffix):
            return head + "PluginImporter:\n" + native_settings(suffix) + END
    for suffix, (importer, settings) in IMPORTERS.items():
        if name.endswith(suffix):
            return head + f"{importer}:\n" + settings + END
    raise ValueError(f"{path}: no importer is known for this kind of file; add one to IMPORTERS in meta.py")


def is_hidden(name):
    """Unity does not import files and folders with such names, so they have no .meta file."""
    return name.startswith(".") or name.endswith("~")


def write_all(folder):
    """Writes all .meta files. The content of a hidden folder has them too: Unity copies samples with their .meta files."""
    for entry in sorted(folder.rglob("*")):
        if is_hidden(entry.name) or entry.suffix == ".meta":
            continue
        text = meta_of(entry.relative_to(folder).as_posix(), entry.is_dir())
        entry.with_name(entry.name + ".meta").write_text(text, encoding="utf-8")


def main(arguments):
    if len(arguments) == 2 and arguments[0] == "--guid":
        print(guid_of(arguments[1]))
        return 0
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print(__doc__, file=sys.stdout if arguments and arguments[0] in ("-h", "--help") else sys.stderr)
        return 0 if arguments and arguments[0] in ("-h", "--help") else 64
    folder = pathlib.Path(arguments[0])
    if not (folder / "package.json").is_file():
        print(f"meta: {folder}/package.json does not exist; expected the folder of an unpacked package", file=sys.stderr)
        return 66
    try:
        write_all(folder)
    except ValueError as fault:
        print(f"meta: {fault}", file=sys.stderr)
        return 65
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
