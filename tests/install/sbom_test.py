"""cmake/package/sbom.py ROOT: bills of materials have what SPDX 2.3 demands, and name the packages that dpkg knows."""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(sys.argv.pop(1))
SCRIPT = ROOT / "cmake/package/sbom.py"
DPKG_QUERY = """#!/bin/sh
printf '%s\\n' "$@" >"$0.arguments"
printf '%s\\t%s\\t%s\\t%s\\t%s\\t%s\\n' \\
    libtbb-dev 2021.8.0-2+deb12u1 amd64 onetbb 2021.8.0-2+deb12u1 installed \\
    libtbb-dev 2021.8.0-2+deb12u1 arm64 onetbb 2021.8.0-2+deb12u1 installed \\
    g++ 4:12.2.0-3 amd64 gcc-defaults 1.203 installed \\
    g-- 1 all g-- 1 installed \\
    gnuplot-nox 5.4.4 amd64 gnuplot 5.4.4 installed \\
    libhwy-dev 1.0.3-3 amd64 highway 1.0.3-3 config-files
echo "dpkg-query: no packages found matching libnone-dev" >&2
exit 1
"""
NAMES = ["libtbb-dev", "g++", "g--", "gnuplot-nox", "libhwy-dev", "libnone-dev"]

# Sections of SPDX 2.3 that demand a field: 6 (document), 7 (package), 11 (relationship).
DOCUMENT_FIELDS = {"spdxVersion", "dataLicense", "SPDXID", "name", "documentNamespace", "creationInfo", "packages",
                   "relationships"}
PACKAGE_FIELDS = {"name", "SPDXID", "versionInfo", "supplier", "downloadLocation", "filesAnalyzed", "licenseConcluded",
                  "licenseDeclared", "copyrightText"}
RELATIONS = {"DESCRIBES", "BUILD_DEPENDENCY_OF", "BUILD_TOOL_OF", "OPTIONAL_DEPENDENCY_OF"}


def faults_of(document: dict) -> list[str]:
    """Returns where a document is not as SPDX 2.3 demands."""
    faults = []

    def expect(is_right: bool, fault: str) -> None:
        if not is_right:
            faults.append(fault)

    expect(set(document) == DOCUMENT_FIELDS, "fields of the document")
    expect(document["spdxVersion"] == "SPDX-2.3", "spdxVersion")
    expect(document["dataLicense"] == "CC0-1.0", "dataLicense")
    expect(document["SPDXID"] == "SPDXRef-DOCUMENT", "SPDXID of the document")
    expect(re.fullmatch(r"https://[^#\s]+", document["documentNamespace"]) is not None, "documentNamespace")
    info = document["creationInfo"]
    expect(re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", info["created"]) is not None, "created")
    expect(len(info["creators"]) > 0, "no creator")
    for creator in info["creators"]:
        expect(re.fullmatch(r"Organization: .+|Tool: \S+", creator) is not None, f"creator {creator}")
    identifiers = [document["SPDXID"]]
    for package in document["packages"]:
        name = package["name"]
        expect(PACKAGE_FIELDS <= set(package), f"{name}: fields")
        expect(all(package[field] != "" for field in PACKAGE_FIELDS), f"{name}: an empty field")
        expect(re.fullmatch(r"SPDXRef-[A-Za-z0-9.-]+", package["SPDXID"]) is not None, f"{name}: SPDXID")
        # Otherwise packageVerificationCode would be demanded.
        expect(package["filesAnalyzed"] is False, f"{name}: filesAnalyzed")
        expect(re.fullmatch(r"Organization: .+", package["supplier"]) is not None, f"{name}: supplier")
        identifiers.append(package["SPDXID"])
        for reference in package.get("externalRefs", []):
            expect(set(reference) == {"referenceCategory", "referenceType", "referenceLocator"}, f"{name}: reference")
            expect(re.fullmatch(r"pkg:deb/[^\s/]+/[^\s+@]+@[^\s+]+\?arch=\w+", reference["referenceLocator"])
                   is not None, f"{name}: locator")
    expect(len(set(identifiers)) == len(identifiers), "an identifier is not unique")
    for relationship in document["relationships"]:
        expect(relationship["spdxElementId"] in identifiers, f"from nowhere: {relationship}")
        expect(relationship["relatedSpdxElement"] in identifiers, f"to nowhere: {relationship}")
        expect(relationship["relationshipType"] in RELATIONS, f"kind: {relationship}")
    described = [r["relatedSpdxElement"] for r in document["relationships"] if r["relationshipType"] == "DESCRIBES"]
    expect(described == [document["packages"][0]["SPDXID"]], "what it describes")
    return faults


class Bill(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        query = self.folder / "dpkg-query"
        query.write_text(DPKG_QUERY, encoding="utf-8")
        query.chmod(0o755)

    def write(self, *arguments: str, path: str = "", zone: str = "UTC") -> "subprocess.CompletedProcess[str]":
        """Writes the file `bill`."""
        environment = dict(os.environ, PATH=path or f"{self.folder}:{os.environ['PATH']}", TZ=zone)
        return subprocess.run(
            [sys.executable, "-B", SCRIPT, "--package", "libmorphray0", "--package-version", "0.1.0-1", "--vendor",
             "the authors", "--copyright", "Copyright 2025 the authors", "--date", "Wed, 25 Nov 2026 09:30:00 +0200",
             "--out", str(self.folder / "bill"), *arguments],
            env=environment, text=True, capture_output=True, check=False)

    def bill(self) -> dict:
        document: dict = json.loads((self.folder / "bill").read_text(encoding="utf-8"))
        return document

    def test_has_what_the_standard_demands(self) -> None:
        self.assertEqual(self.write("--commit", "abc", "--built-with", *NAMES).returncode, 0)
        self.assertEqual(faults_of(self.bill()), [])

    def test_names_the_package_and_what_is_installed(self) -> None:
        self.write("--commit", "abc", "--built-with", *NAMES)
        asked = (self.folder / "dpkg-query.arguments").read_text(encoding="utf-8").split("\n")
        for name in NAMES:
            self.assertIn(name, asked)
        document = self.bill()
        self.assertEqual([p["name"] for p in document["packages"]],
                         ["libmorphray0", "g++", "g--", "gnuplot-nox", "libtbb-dev"])
        own, compiler, _, _, library = document["packages"]
        self.assertEqual(own["versionInfo"], "0.1.0-1")
        self.assertEqual(own["licenseDeclared"], "MIT")
        self.assertEqual(own["sourceInfo"], "built from commit abc")
        self.assertEqual(compiler["sourceInfo"], "built from source package gcc-defaults 1.203")
        self.assertEqual(library["versionInfo"], "2021.8.0-2+deb12u1")
        self.assertTrue(library["externalRefs"][0]["referenceLocator"].endswith(
            "/libtbb-dev@2021.8.0-2%2Bdeb12u1?arch=amd64"))
        kinds = {r["spdxElementId"]: r["relationshipType"] for r in document["relationships"]}
        self.assertEqual(kinds[compiler["SPDXID"]], "BUILD_TOOL_OF")
        self.assertEqual(kinds[library["SPDXID"]], "BUILD_DEPENDENCY_OF")
        self.assertEqual(kinds["SPDXRef-Package-gnuplot-nox"], "OPTIONAL_DEPENDENCY_OF")
        self.assertEqual(document["creationInfo"]["created"], "2026-11-25T07:30:00Z")

    def test_the_same_input_gives_the_same_bytes(self) -> None:
        self.write("--built-with", *NAMES)
        first = (self.folder / "bill").read_bytes()
        self.write("--built-with", *reversed(NAMES), zone="Asia/Kathmandu")
        self.assertEqual((self.folder / "bill").read_bytes(), first)
        self.write("--commit", "abc", "--built-with", *NAMES)
        other = self.bill()
        self.assertNotEqual(other["documentNamespace"], json.loads(first)["documentNamespace"])

    def test_is_whole_without_packages_and_without_dpkg(self) -> None:
        self.assertEqual(self.write().returncode, 0)
        self.assertEqual([p["name"] for p in self.bill()["packages"]], ["libmorphray0"])
        self.assertEqual(faults_of(self.bill()), [])
        self.assertEqual(self.write("--built-with", "g++", path="/nowhere").returncode, 0)
        self.assertEqual([p["name"] for p in self.bill()["packages"]], ["libmorphray0"])

    def test_refuses_what_is_no_name_of_a_package(self) -> None:
        result = self.write("--built-with", "g++", "../etc")
        self.assertEqual(result.returncode, 2)
        self.assertIn("'../etc' is no name of a Debian package", result.stderr)
        self.assertFalse((self.folder / "bill").exists())

    def test_faults_are_found(self) -> None:
        self.write("--built-with", *NAMES)
        for fault, plant in (
                ("an identifier is not unique", lambda d: d["packages"].append(d["packages"][1])),
                ("libmorphray0: fields", lambda d: d["packages"][0].pop("downloadLocation")),
                ("spdxVersion", lambda d: d.update(spdxVersion="SPDX-2.2")),
                ("created", lambda d: d["creationInfo"].update(created="2026-11-25")),
                ("what it describes", lambda d: d["relationships"].pop(0)),
                ("g++: SPDXID", lambda d: d["packages"][1].update(SPDXID="SPDXRef-g++"))):
            document = self.bill()
            plant(document)
            try:
                faults = faults_of(document)
            except KeyError as error:
                faults = [f"libmorphray0: fields lacks {error}"]
            self.assertTrue(any(found.startswith(fault) for found in faults), (fault, faults))


if __name__ == "__main__":
    unittest.main()
