#!/usr/bin/env python3
"""scripts/figures on a copy of what a few cheap figures need: what comes out, and what is made again when.

figures_test.py PROGRAM      PROGRAM: polymorph. Exit code 77: matplotlib is missing and setup could not install it.
"""

import csv
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import xml.dom.minidom
import zlib

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = sys.argv.pop()
CHEAP = ["graph3.1", "fig5.3", "fig5.6"]


def png_size(path):
    """Width and height; an error where the file is not a whole PNG."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", path
    at, kinds, pixels = 8, [], b""
    while at < len(data):
        (length,), kind = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
        body = data[at + 8 : at + 8 + length]
        assert zlib.crc32(kind + body) == struct.unpack(">I", data[at + 8 + length : at + 12 + length])[0], path
        kinds.append(kind)
        pixels += body if kind == b"IDAT" else b""
        at += 12 + length
    assert kinds[-1] == b"IEND" and zlib.decompress(pixels), path
    return struct.unpack(">II", data[16:24])


class Figures(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="polymorph-figures-test-")
        self.addCleanup(self.temporary.cleanup)
        self.copy = pathlib.Path(self.temporary.name) / "repository"
        shutil.copytree(ROOT / "scripts", self.copy / "scripts", ignore=shutil.ignore_patterns("models", "__pycache__"))
        (self.copy / "scenes/models").mkdir(parents=True)
        for model in ("cube", "monkey"):
            for file in (ROOT / "scenes/models").glob(f"{model}.*"):
                shutil.copy(file, self.copy / "scenes/models")
        self.out = self.copy.parent / "out"

    def run_figures(self, only, code=0, blender=""):
        command = [self.copy / "scripts/figures", self.out, "--program", PROGRAM, "--blender", blender]
        command += [x for name in only for x in ("--only", name)]
        done = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.made = [line.split()[0] for line in done.stdout.splitlines() if " made " in line and line[0] in "fgt"]
        return done

    def edit(self, path, old, new):
        path = self.copy / path
        text = path.read_text()
        self.assertIn(old, text)
        path.write_text(text.replace(old, new))

    def test_figures_are_whole_and_made_again_only_when_something_changed(self):
        self.run_figures(CHEAP)
        self.assertEqual(self.made, CHEAP)
        for name in CHEAP:
            self.assertGreater(min(png_size(self.out / f"{name}.png")), 300)
            xml.dom.minidom.parse(str(self.out / f"{name}.svg"))
        for file in self.out.glob("*.csv"):
            rows = list(csv.reader(file.read_text().splitlines()))
            self.assertGreater(len(rows), 1, file)
            self.assertEqual({len(row) for row in rows}, {len(rows[0])}, file)
        weights = [row[-1] for row in csv.reader((self.out / "fig5.6.csv").read_text().splitlines())][1:]
        self.assertEqual(weights, ["128", "64", "32", "16", "8", "4", "2", "1"])
        page = (self.out / "index.html").read_text()
        for name in CHEAP:
            self.assertIn(f'<section id="{name}">', page)
            self.assertIn(f'src="{name}.svg"', page)
        self.assertEqual(list(self.out.rglob("*.part")), [])

        self.run_figures(CHEAP)
        self.assertEqual(self.made, [], "nothing changed")

        # A model that one reads, the code of another, and of a third only a comment and a figure beside it.
        with (self.copy / "scenes/models/cube.obj").open("a") as file:
            file.write("# changed\n")
        self.edit("scripts/figures_lib/chapter5_spheres.py", '"Polygon inclusion"', '"Point in polygon"')
        self.edit("scripts/figures_lib/chapter5_surface.py", '"Three blob constants"', '"Blob constants"')
        self.edit("scripts/figures_lib/chapter5_surface.py", "CUBE_VIEW =", "# From the left.\nCUBE_VIEW =")
        self.run_figures(CHEAP)
        self.assertEqual(self.made, ["graph3.1", "fig5.3"])

    def test_suzanne_is_blenders_where_there_is_blender(self):
        blender = self.copy.parent / "blender"
        blender.write_text(f'#!/bin/sh\nfor last; do :; done\ncp {self.copy}/scenes/models/cube.obj "$last"\n')
        blender.chmod(0o755)
        self.run_figures(["fig5.4"], blender=str(blender))
        self.assertTrue((self.out / "models/suzanne.obj").exists())
        self.assertIn("Suzanne is Blender's own", (self.out / "index.html").read_text())

    def test_the_stages_are_found_in_what_the_program_says_of_a_scene(self):
        # Cheap models in the place of the figure's own.
        for name in ("teapot", "penguin"):
            shutil.copy(ROOT / "scenes/models/cube.obj", self.copy / f"scenes/models/{name}.obj")
        (self.copy / "scenes/golden").mkdir()
        shutil.copy(ROOT / "scenes/golden/report-method.json", self.copy / "scenes/golden")
        self.run_figures(["fig6.7"])
        rows = list(csv.reader((self.out / "fig6.7.csv").read_text().splitlines()))[1:]
        self.assertEqual({method for method, _, _ in rows}, {"report", "ours"})
        for stage in ("boundary-out", "volume", "boundary-in"):
            self.assertIn(stage, [row[2] for row in rows])

    def test_unknown_names_are_told_with_all_that_there_are(self):
        done = self.run_figures(["fig9.9"], code=2)
        self.assertIn("fig9.9", done.stderr)
        self.assertIn("fig6.1", done.stderr)


if __name__ == "__main__":
    looked = [sys.executable, "/usr/bin/python3"]  # scripts/figures looks in the same places
    if all(subprocess.run([p, "-c", "import matplotlib"], capture_output=True).returncode for p in looked):
        system = pathlib.Path("/etc/os-release").read_text() if pathlib.Path("/etc/os-release").exists() else ""
        if "ID=debian" not in system:
            print("matplotlib is missing, and scripts/setup installs it on Debian only: skipped")
            sys.exit(77)
    unittest.main()
