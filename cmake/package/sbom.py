#!/usr/bin/env python3
"""Writes a software bill of materials, SPDX 2.3 as JSON, of a Debian package of morphray: the package, and the Debian
packages that it was built with. The same input gives the same bytes."""

import argparse
import datetime
import email.utils
import hashlib
import json
import pathlib
import re
import subprocess
import sys
import urllib.parse

# The program starts or loads these where they are installed; they are no part of a build.
OPTIONAL = {"gnuplot-nox", "mesa-vulkan-drivers"}
FIELDS = ("Package", "Version", "Architecture", "source:Package", "source:Version", "db:Status-Status")


def installed_packages(names: list[str]) -> list[dict[str, str]]:
    """Returns the fields of those packages that are installed, by name. A package of two architectures is listed
    once. Without dpkg-query there are none."""
    form = "\\t".join(f"${{{field}}}" for field in FIELDS) + "\\n"
    try:
        # It ends with 1 if one of them is not installed, and lists the others.
        output = subprocess.run(["dpkg-query", "-W", "-f", form, *names], check=False, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout if names else ""
    except FileNotFoundError:
        output = ""
    packages: dict[str, dict[str, str]] = {}
    for line in sorted(output.splitlines()):
        fields = dict(zip(FIELDS, line.split("\t")))
        if fields["db:Status-Status"] == "installed":
            packages.setdefault(fields["Package"], fields)
    return [packages[name] for name in sorted(packages)]


def distribution() -> dict[str, str]:
    """Returns ID and NAME of the system, such as debian and Debian GNU/Linux."""
    lines = pathlib.Path("/etc/os-release").read_text(encoding="utf-8").splitlines()
    return {key: value.strip("\"'") for key, _, value in (line.partition("=") for line in lines)}


def identifier(package: str) -> str:
    """Identifiers have letters, digits, dots and dashes alone. Names of Debian packages have a plus, too, and no
    capital letters."""
    return "SPDXRef-Package-" + package.replace("+", "P")


def relation(package: str) -> str:
    if package in OPTIONAL:
        return "OPTIONAL_DEPENDENCY_OF"
    return "BUILD_DEPENDENCY_OF" if package.endswith("-dev") else "BUILD_TOOL_OF"


def package_entry(fields: dict[str, str], system: dict[str, str]) -> dict[str, object]:
    name, version = fields["Package"], fields["Version"]
    locator = (f"pkg:deb/{system['ID']}/{urllib.parse.quote(name)}@{urllib.parse.quote(version, safe='.-_~:')}"
               f"?arch={fields['Architecture']}")
    return {
        "name": name,
        "SPDXID": identifier(name),
        "versionInfo": version,
        "supplier": f"Organization: {system['NAME']}",
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "sourceInfo": f"built from source package {fields['source:Package']} {fields['source:Version']}",
        "licenseConcluded": "NOASSERTION",
        "licenseDeclared": "NOASSERTION",
        "copyrightText": "NOASSERTION",
        "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                          "referenceLocator": locator}],
    }


def bill(package: str, version: str, vendor: str, copyright_text: str, commit: str, date: datetime.datetime,
         built_with: list[dict[str, str]], system: dict[str, str]) -> dict[str, object]:
    """Returns the document. `commit` may be empty."""
    main = {
        "name": package,
        "SPDXID": identifier(package),
        "versionInfo": version,
        "supplier": f"Organization: {vendor}",
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "licenseConcluded": "MIT",
        "licenseDeclared": "MIT",
        "copyrightText": copyright_text,
    }
    if commit:
        main["sourceInfo"] = f"built from commit {commit}"
    packages = [main] + [package_entry(fields, system) for fields in built_with]
    relationships = [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                      "relatedSpdxElement": main["SPDXID"]}]
    for fields in built_with:
        relationships.append({"spdxElementId": identifier(fields["Package"]),
                              "relationshipType": relation(fields["Package"]),
                              "relatedSpdxElement": main["SPDXID"]})
    # Documents that differ have names that differ.
    content = hashlib.sha256(json.dumps([packages, relationships, date.isoformat()]).encode()).hexdigest()
    return {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"{package}-{version}",
        "documentNamespace": f"https://morphray.example/spdx/{package}-{version}-{content[:32]}",
        "creationInfo": {"created": date.strftime("%Y-%m-%dT%H:%M:%SZ"),
                         "creators": [f"Organization: {vendor}", f"Tool: morphray-sbom-{version}"]},
        "packages": packages,
        "relationships": relationships,
    }


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--package", required=True, help="name of the package that is described")
    parser.add_argument("--package-version", required=True)
    parser.add_argument("--vendor", required=True)
    parser.add_argument("--copyright", required=True)
    parser.add_argument("--commit", default="")
    parser.add_argument("--date", required=True, help="as RFC 5322 writes it")
    parser.add_argument("--built-with", nargs="*", default=[], help="names of Debian packages")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    given = parser.parse_args(arguments)
    for name in given.built_with:
        if not re.fullmatch("[a-z0-9][-+.a-z0-9]+", name):
            parser.error(f"{name!r} is no name of a Debian package")
    date = email.utils.parsedate_to_datetime(given.date).astimezone(datetime.timezone.utc)
    document = bill(given.package, given.package_version, given.vendor, given.copyright, given.commit, date,
                    installed_packages(given.built_with), distribution())
    given.out.write_text(json.dumps(document, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
