"""Checks bills of materials against the SPDX 2.3 specification and against the packages that they describe.

usage: sbom.py FOLDER     checks the .spdx.json file of each package in a folder; prints faults; exit code 1 if there is one
"""

import hashlib
import json
import pathlib
import re
import subprocess
import sys

ID = re.compile(r"SPDXRef-[A-Za-z0-9.-]+$")
NEEDED = {"spdxVersion", "dataLicense", "SPDXID", "name", "documentNamespace", "creationInfo", "packages", "relationships"}
NEEDED_OF_PACKAGE = {"name", "SPDXID", "downloadLocation"}
KINDS = {"DESCRIBES", "DEPENDS_ON", "BUILD_DEPENDENCY_OF"}


def faults_of_document(document):
    """The faults by the specification alone: required fields, identifiers, relationships."""
    missing = NEEDED - document.keys()
    if missing:
        return [f"no {field}" for field in sorted(missing)]
    faults = []
    if document["spdxVersion"] != "SPDX-2.3" or document["dataLicense"] != "CC0-1.0" or document["SPDXID"] != "SPDXRef-DOCUMENT":
        faults.append("spdxVersion, dataLicense or SPDXID is not as the specification fixes them")
    if not re.match(r"https?://[^#]+$", document["documentNamespace"]):
        faults.append("documentNamespace is no URI without '#'")
    created = document["creationInfo"]
    if not re.match(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$", created.get("created", "")):
        faults.append("creationInfo has no time of creation in UTC")
    if not all(re.match(r"(Person|Organization|Tool): \S", each) for each in created.get("creators") or [""]):
        faults.append("creationInfo has no creators")
    for package in document["packages"]:
        lacks = NEEDED_OF_PACKAGE - package.keys()
        if lacks or not ID.match(package.get("SPDXID", "")):
            faults.append(f"package {package.get('name')}: no {sorted(lacks)}, or a malformed SPDXID")
    ids = [package.get("SPDXID") for package in document["packages"]] + ["SPDXRef-DOCUMENT"]
    if len(set(ids)) != len(ids):
        faults.append("an SPDXID is there twice")
    for each in document["relationships"]:
        if each.get("relationshipType") not in KINDS or {each.get("spdxElementId"), each.get("relatedSpdxElement")} - set(ids):
            faults.append(f"a relationship of an unknown kind or element: {each}")
    if not any(each.get("relationshipType") == "DESCRIBES" for each in document["relationships"]):
        faults.append("nothing is described")
    return faults


def names_needed(deb):
    """The names in Depends and Pre-Depends, one set of alternatives for each part; read with another tool than the writer uses."""
    text = subprocess.run(["dpkg-deb", "--show", "--showformat=${Pre-Depends},${Depends}", deb], capture_output=True, text=True,
                          check=True).stdout
    return [{re.split(r"[\s:(]", each.strip())[0] for each in part.split("|")} for part in text.split(",") if part.strip()]


def providers_of(name):
    """The installed packages that provide a virtual package."""
    done = subprocess.run(["dpkg-query", "--show", "--showformat=${Package}|${Provides}\n"], capture_output=True, text=True, check=True)
    lines = [line.partition("|") for line in done.stdout.splitlines()]
    return {package for package, _, provided in lines if name in re.findall(r"(?:^|,\s*)([^\s,(]+)", provided)}


def faults_of_package(deb):
    """The faults of the file beside a package."""
    path = deb.with_suffix(".spdx.json")
    if not path.exists():
        return ["there is no such file"]
    document = json.loads(path.read_text())
    faults = faults_of_document(document)
    if faults:
        return faults
    described = [each["relatedSpdxElement"] for each in document["relationships"] if each["relationshipType"] == "DESCRIBES"]
    main = next(each for each in document["packages"] if each["SPDXID"] == described[0])
    if main["checksums"] != [{"algorithm": "SHA256", "checksumValue": hashlib.sha256(deb.read_bytes()).hexdigest()}]:
        faults.append("the checksum is not that of the package")
    by_id = {each["SPDXID"]: each for each in document["packages"]}
    needs = {by_id[each["relatedSpdxElement"]]["name"] for each in document["relationships"]
             if each["relationshipType"] == "DEPENDS_ON"}
    faults += [f"{' or '.join(sorted(part))} is a dependency and not listed" for part in names_needed(deb)
               if not part & needs and not any(providers_of(name) & needs for name in part)]
    return faults + [f"{name} has no version" for name in sorted(needs)
                     if not next(each for each in by_id.values() if each["name"] == name).get("versionInfo")]


def main():
    debs = sorted(pathlib.Path(sys.argv[1]).glob("*.deb"))
    faults = [f"{deb.name}: {fault}" for deb in debs for fault in faults_of_package(deb)]
    print("\n".join(faults) or f"{len(debs)} bills of materials are valid")
    return 1 if faults or not debs else 0


if __name__ == "__main__":
    sys.exit(main())
