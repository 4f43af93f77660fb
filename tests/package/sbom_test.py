#!/usr/bin/env python3
"""sbom_test.py BUILD VENV: the bill of materials of the Debian package is SPDX 2.3, names what ldd, Debian's database and the sources of the
programs say is in them, and is the same bytes each time. PyPI's spdx-tools validates it, too, in the virtual environment VENV, where it can be had."""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

BUILD, VENV = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
sys.argv[1:] = []
SOURCE = pathlib.Path(__file__).resolve().parents[2]
PROGRAMS = [BUILD / name for name in ("polymorph", "polymorph_oiio.so", "polymorph_assimp")]
REQUIRED = {"document": ("spdxVersion", "dataLicense", "SPDXID", "name", "documentNamespace", "creationInfo"),
            "package": ("SPDXID", "name", "downloadLocation", "licenseConcluded", "licenseDeclared", "copyrightText"),
            "relationship": ("spdxElementId", "relationshipType", "relatedSpdxElement")}


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def faults(document):
    """Breaches of SPDX 2.3 (clauses 6 to 11)."""
    packages, relationships = document.get("packages", []), document.get("relationships", [])
    found = [f"document: no {key}" for key in REQUIRED["document"] if not document.get(key)]
    for kind, entries in (("package", packages), ("relationship", relationships)):
        found += [f"{kind} {entry.get('name', '')}: no {key}" for entry in entries for key in REQUIRED[kind] if not entry.get(key)]
    if (document.get("spdxVersion"), document.get("dataLicense"), document.get("SPDXID")) != ("SPDX-2.3", "CC0-1.0", "SPDXRef-DOCUMENT"):
        found.append("document: not SPDX 2.3")
    creation = document.get("creationInfo", {})
    if not re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", creation.get("created", "")) or not creation.get("creators"):
        found.append("document: creationInfo is not complete")
    names = [entry.get("SPDXID", "") for entry in packages]
    found += [f"{name}: not a name" for name in names if not re.fullmatch(r"SPDXRef-[A-Za-z0-9.-]+", name)]
    found += [f"{name}: twice" for name in set(names) if names.count(name) > 1]
    known = {*names, "SPDXRef-DOCUMENT"}
    found += [f"{entry[end]}: no such element" for entry in relationships for end in ("spdxElementId", "relatedSpdxElement") if entry.get(end) not in known]
    if not any(entry.get("relationshipType") == "DESCRIBES" for entry in relationships):
        found.append("document: describes nothing")
    texts = {entry["licenseId"] for entry in document.get("hasExtractedLicensingInfos", []) if entry.get("extractedText")}
    used = set(re.findall(r"LicenseRef-[A-Za-z0-9.-]+", " ".join(entry.get("licenseDeclared", "") for entry in packages)))
    return found + [f"{name}: without a text" for name in used - texts]


class Sbom(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.text = output(SOURCE / "scripts/sbom", BUILD, "polymorph", *PROGRAMS)
        cls.document = json.loads(cls.text)
        cls.packages = {entry["name"]: entry for entry in cls.document["packages"]}

    def linked(self, kind):
        by_id = {entry["SPDXID"]: entry for entry in self.document["packages"]}
        root = self.packages["polymorph"]["SPDXID"]
        return {by_id[entry["relatedSpdxElement"]]["name"]: by_id[entry["relatedSpdxElement"]] for entry in self.document["relationships"]
                if entry["relationshipType"] == kind and entry["spdxElementId"] == root}

    def test_is_spdx(self):
        self.assertEqual(faults(self.document), [])

    def test_faults_are_found(self):
        for change in (lambda d: d.pop("dataLicense"), lambda d: d["packages"][1].pop("licenseDeclared"), lambda d: d["packages"].pop(),
                       lambda d: d["creationInfo"].update(created="yesterday"), lambda d: d["relationships"].pop(0)):
            broken = json.loads(self.text)
            change(broken)
            self.assertNotEqual(faults(broken), [])

    def test_same_bytes_each_time(self):
        self.assertEqual(output(SOURCE / "scripts/sbom", BUILD, "polymorph", *PROGRAMS), self.text)

    def test_is_what_the_build_made(self):
        self.assertEqual(json.loads((BUILD / "polymorph.spdx.json").read_text(encoding="utf-8"))["packages"][1:], self.document["packages"][1:])

    def test_names_every_library_that_is_loaded(self):
        libraries = set(re.findall(r"=> (/\S+)", "".join(output("ldd", program) for program in PROGRAMS)))
        self.assertGreater(len(libraries), 20)
        # Packages name a file of /usr/lib as that or as one of /lib. One question for all, because dpkg-query reads its whole database for each.
        names = {library: str(pathlib.Path(library).resolve()) for library in libraries}
        asked = [path for real in names.values() for path in (real, real.removeprefix("/usr"))]
        answer = subprocess.run(["dpkg-query", "-S", *asked], capture_output=True, text=True, check=False).stdout
        owners = {line.rsplit(": ", 1)[1]: line.split(":")[0] for line in answer.splitlines()}
        self.assertGreater(len(owners), 20)
        for library, real in names.items():
            name = owners.get(real) or owners.get(real.removeprefix("/usr")) or pathlib.Path(library).name
            self.assertIn(name, self.packages)

    def test_versions_are_those_installed(self):
        for name in ("libembree3-3", "libassimp5", "libopenexr-3-1-30", "libeigen3-dev"):
            self.assertEqual(self.packages[name]["versionInfo"], output("dpkg-query", "-W", "-f", "${Version}", name))

    def test_headers_and_static_libraries_are_in_it(self):
        self.assertLessEqual({"libeigen3-dev", "libcli11-dev", "nlohmann-json3-dev", "liblemon-dev", "libmeshoptimizer-dev"}, set(self.linked("STATIC_LINK")))

    def test_nothing_that_is_linked_is_under_the_gpl_alone(self):
        for name, entry in {**self.linked("STATIC_LINK"), **self.linked("DYNAMIC_LINK")}.items():
            alternatives = entry["licenseDeclared"].strip("()").split(" OR ")
            self.assertTrue(any(not re.search(r"(?<!L)GPL-", one) for one in alternatives), f"{name}: {entry['licenseDeclared']}")

    def test_licences_of_the_main_libraries_are_known(self):
        licences = {name: self.packages[name]["licenseDeclared"] for name in ("libembree3-3", "libassimp5", "libeigen3-dev", "zlib1g", "libnettle8")}
        self.assertEqual(licences, {"libembree3-3": "Apache-2.0", "libassimp5": "BSD-3-Clause", "libeigen3-dev": "MPL-2.0", "zlib1g": "Zlib",
                                    "libnettle8": "(LGPL-3.0-or-later OR GPL-2.0-or-later)"})

    def test_others_find_it_valid(self):
        if not (VENV / "bin/pyspdxtools").exists():
            made = subprocess.run(["/usr/bin/python3", "-m", "venv", VENV], capture_output=True, check=False).returncode == 0
            if not made or subprocess.run([VENV / "bin/pip", "-q", "install", "spdx-tools"], capture_output=True, check=False).returncode:
                self.skipTest("spdx-tools cannot be had")
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "polymorph.spdx.json"
            file.write_text(self.text, encoding="utf-8")
            done = subprocess.run([VENV / "bin/pyspdxtools", "-i", file], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            broken = json.loads(self.text)
            broken["packages"][1]["licenseDeclared"] = "no licence at all"
            file.write_text(json.dumps(broken), encoding="utf-8")
            self.assertNotEqual(subprocess.run([VENV / "bin/pyspdxtools", "-i", file], capture_output=True, check=False).returncode, 0)


if __name__ == "__main__":
    unittest.main()
