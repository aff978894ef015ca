#!/usr/bin/env python3
"""Writes the software bill of materials of Debian packages: PACKAGE.spdx.json beside each PACKAGE.deb.

usage: sbom.py PACKAGE.deb...

Format: SPDX 2.3, JSON (spdx.github.io/spdx-spec/v2.3). Listed are the package with its checksum; the packages that it depends on, by
the fields Depends and Pre-Depends, each in the version that is installed on this machine, against which the package was built; and
the packages that its source is built with (debian/control), because libraries of headers alone are part of the programs. The time is
$SOURCE_DATE_EPOCH, so that the same package gives the same file.

exit codes: 0 done, 64 wrong command line, 66 a package cannot be read
"""

import datetime
import functools
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import uuid

FOLDER = pathlib.Path(__file__).resolve().parent


def fields_of_package(path):
    """The control fields of a .deb file."""
    text = subprocess.run(["dpkg-deb", "--field", path], capture_output=True, text=True, check=True).stdout
    return {name: " ".join(value.split()) for name, value in re.findall(r"^([\w-]+):((?:.*\n(?: .*\n)*))", text, re.M)}


def build_dependencies():
    """The names in Build-Depends of debian/control."""
    text = re.search(r"^Build-Depends:((?:.*\n(?: .*\n)*))", (FOLDER / "control").read_text(), re.M).group(1)
    return [alternatives[0][0] for alternatives in relations(text)]


def own_license():
    return re.search(r"^License: (\S+)", (FOLDER / "copyright").read_text(), re.M).group(1)


def relations(text):
    """Reads "a (>= 1), b | c": for each part its alternatives, as (name, version after '=' or None)."""
    parts = [part for part in text.replace("\n", " ").split(",") if part.strip()]
    found = []
    for part in parts:
        words = [re.match(r"\s*([a-z0-9][a-z0-9+.-]*)(?::\w+)?\s*(?:\(\s*=\s*([^)\s]+)\s*\))?", each) for each in part.split("|")]
        found.append([(word.group(1), word.group(2)) for word in words if word])
    return [each for each in found if each]


@functools.cache
def installed_versions():
    """The version of each package of this machine."""
    done = subprocess.run(["dpkg-query", "--show", "--showformat=${db:Status-Status} ${Package} ${Version}\n"], capture_output=True,
                          text=True, check=True)
    lines = [line.split() for line in done.stdout.splitlines()]
    return {words[1]: words[2] for words in lines if words[0] == "installed" and len(words) == 3}


@functools.cache
def providers():
    """The package of this machine that provides each virtual package."""
    done = subprocess.run(["dpkg-query", "--show", "--showformat=${db:Status-Status}\t${Package}\t${Provides}\n"], capture_output=True,
                          text=True, check=True)
    lines = [line.split("\t") for line in done.stdout.splitlines()]
    return {name: package for status, package, provided in lines if status == "installed"
            for alternatives in relations(provided) for name, _ in alternatives}


def version_of(name, exact, siblings):
    return siblings.get(name) or installed_versions().get(name) or exact


def chosen(alternatives, siblings):
    """The first alternative that exists here, as (name, version); the version is None if it is unknown. A virtual package is listed as
    the package that provides it."""
    known = [(name, version_of(name, exact, siblings)) for name, exact in alternatives]
    known += [(providers()[name], version_of(providers()[name], None, siblings)) for name, _ in alternatives if name in providers()]
    return next((each for each in known if each[1]), known[0])


def element(name, version, license_declared="NOASSERTION"):
    """One package of the document."""
    made = {"name": name, "SPDXID": "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name.replace("+", "p")), "downloadLocation": "NOASSERTION",
            "filesAnalyzed": False, "licenseConcluded": "NOASSERTION", "licenseDeclared": license_declared,
            "copyrightText": "NOASSERTION", "supplier": "NOASSERTION"}
    purl = f"pkg:deb/debian/{name}"
    if version:
        made["versionInfo"] = version
        purl += "@" + version.replace("+", "%2B").replace(":", "%3A").replace("~", "%7E")
    made["externalRefs"] = [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": purl}]
    return made


def document_of(path, fields, siblings):
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    main = element(fields["Package"], fields["Version"], own_license())
    main["supplier"] = "Organization: " + fields["Maintainer"]
    main["checksums"] = [{"algorithm": "SHA256", "checksumValue": digest}]
    main["packageFileName"] = path.name
    packages = {main["name"]: main}
    relationships = [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": main["SPDXID"]}]

    def relate(name, version, kind, reverse):
        other = packages.setdefault(name, element(name, version))
        ends = (other["SPDXID"], main["SPDXID"]) if reverse else (main["SPDXID"], other["SPDXID"])
        relationships.append({"spdxElementId": ends[0], "relationshipType": kind, "relatedSpdxElement": ends[1]})

    needed = ", ".join(fields[field] for field in ("Pre-Depends", "Depends") if field in fields)
    for name, version in dict.fromkeys(chosen(alternatives, siblings) for alternatives in relations(needed)):
        relate(name, version, "DEPENDS_ON", reverse=False)
    if fields["Architecture"] != "all":
        for name in build_dependencies():
            relate(name, version_of(name, None, siblings), "BUILD_DEPENDENCY_OF", reverse=True)
    created = datetime.datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), datetime.timezone.utc)
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": path.stem,
            "documentNamespace": f"https://spdx.org/spdxdocs/{path.stem}-{uuid.uuid5(uuid.NAMESPACE_OID, digest)}",
            "creationInfo": {"created": created.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: mocapd-sbom"]},
            "packages": list(packages.values()), "relationships": relationships}


def main():
    paths = [pathlib.Path(each) for each in sys.argv[1:]]
    if not paths or any(each.suffix != ".deb" for each in paths):
        print(__doc__, file=sys.stderr)
        return 64
    try:
        fields = {path: fields_of_package(path) for path in paths}
    except subprocess.CalledProcessError as error:
        print(f"sbom: {error.cmd[-1]}: {error.stderr.strip()}", file=sys.stderr)
        return 66
    siblings = {each["Package"]: each["Version"] for each in fields.values()}
    for path in paths:
        text = json.dumps(document_of(path, fields[path], siblings), indent=1)
        path.with_suffix(".spdx.json").write_text(text + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
