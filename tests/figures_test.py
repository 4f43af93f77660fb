#!/usr/bin/env python3
"""scripts/figures: on a copy of what a few cheap figures need, what is made again when; and every figure of the report, in parts.

figures_test.py PROGRAM [PART]     PROGRAM: polymorph; PART: of PARTS, its figures alone, made and looked at
Exit code 77: matplotlib or VTK is missing and setup could not install it.
"""

import csv
import html
import json
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import xml.dom.minidom
import zlib

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = sys.argv[1]
PART = sys.argv[2] if len(sys.argv) > 2 else ""
CHEAP = ["graph3.1", "fig5.3", "fig5.6"]
# Of about the same work. The analyses of the four morph tests are those of Table 6.4. The last part has all other figures.
PARTS = {
    "surfaces": ["table5.1", "table5.2", "fig5.8", "graph5.1", "fig5.10", "fig5.11", "fig5.13", "table6.1", "table6.2", "table6.3", "table6.5"],
    "morph_tests": ["fig6.1", "fig6.2", "fig6.3", "fig6.4", "table6.4"],
    "chains": ["fig6.5", "fig6.6", "fig6.7", "fig6.8"],
    "others": None,
}


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
        blender.write_text(f'#!/bin/sh\nfor last; do :; done\necho "Writing to $last"\ncp {self.copy}/scenes/models/cube.obj "$last"\n')
        blender.chmod(0o755)
        done = self.run_figures(["fig5.4"], blender=str(blender))
        self.assertNotIn("Writing", done.stdout + done.stderr, "Blender's own words are not the figures'")
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


def read_rows(path):
    """The rows of a CSV below its head, numbers as numbers and empty cells as None."""
    def value(cell):
        try:
            return float(cell) if cell else None
        except ValueError:
            return cell
    head, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
    return head, [[value(cell) for cell in row] for row in rows]


# What must hold of a figure's numbers, whatever the machine: of the rows of NAME.csv, or NAME-PART.csv.
NUMBERS = {
    "fig2.1": lambda r: r[0][1:] == [80, r[0][2]] and 15 < r[0][2] < 25 and r[1][2] == 0,
    "fig2.2": lambda r: all(0.85 < row[2] < 1 for row in r[1:]),
    "fig2.3": lambda r: [row[2] for row in r] == [0, 4],
    "fig3.2": lambda r: abs(r[1][4]) < abs(r[0][4]) < 10,
    "graph3.1": lambda r: all(a[2] >= b[2] for a, b in zip(r, r[1:])) and r[-1][2] == 0,
    "fig5.2": lambda r: r[-1][1] > 10 * r[-1][2] and r[0][1:] == [0, 0],
    "fig5.3": lambda r: abs(r[0][5] - r[0][6]) < 1e-9 < r[1][5] - r[1][6],
    "fig5.4": lambda r: [row[1] for row in r] == [1, 8, 64] and r[2][2] <= 64,
    "fig5.5": lambda r: r[-1][1] > r[-2][1] > r[-3][1] > 0,
    "fig5.7": lambda r: sum(row[3] for row in r) == 256,
    "fig5.8": lambda r: r[0][2] > 1 == r[3][2] and r[0][3] < r[1][3] < r[2][3] and abs(r[3][3] - 1) < 0.01,
    # A surface crosses as many cells as the square of the resolution, far fewer than there are.
    "graph5.1": lambda r: all(2.5 < b[2] / a[2] < 6 for a, b in zip(r, r[1:]) if b[0] == 2 * a[0]) and r[-1][2] < r[-1][1] / 50,
    "fig5.10": lambda r: r[0][2] == 0 < r[1][2] < r[2][2] < r[3][2] and 1.5 < r[0][1] < 2.2,
    "fig5.11": lambda r: all(0 < row[4] < row[3] <= 100 for row in r),
    "table5.1": lambda r: r[0][2] < r[1][2] < r[2][2] and r[0][3] < r[1][3] < r[2][3] < r[3][3] and r[3][3] > 0.99,
    "table5.2": lambda r: r[1][3] < r[0][3] < r[2][3] <= r[3][3],
    "table6.1": lambda r: len(r) == 4 and all(row[2] > 4000 and row[5] > 0.5 for row in r),
    "table6.2": lambda r: all(row[3] < row[5] and row[5] > 0.99 and row[7] < row[6] for row in r),
    "table6.3": lambda r: all(500 < row[2] < 3500 and 500 < row[3] < 3500 for row in r),
    "table6.5": lambda r: all(a[4] < b[4] and b[4] > 0.97 for a, b in zip(r[::2], r[1::2])),
    "table6.4": lambda r: len(r) >= 12,
    "table6.4-turned": lambda r: all(row[4] > 80 for row in r if row[1] != "ours") and all(row[4] < 2 for row in r[2:6:3]),
    "graph6.1": lambda r: all(a[1] > 0 and a[2] > 0 for a in r) and r[0][2] > 3 * r[-1][2],
    "fig6.7": lambda r: {row[0] for row in r} == {"report", "ours"} and len(r) == 14,
}
for name in ("fig6.1", "fig6.2", "fig6.3", "fig6.4", "fig6.5", "fig6.6", "fig6.8"):
    # Of each morph by our method: nothing of the volume is lost on the way, ends are slow, and it is more rigid than by the other plan.
    NUMBERS[name] = lambda r: len(r) % 3 == 0 and all(
        row[1] == "ours" and row[6] > 0.97 and 0 < row[8] < 0.3 and 0 < row[9] < 0.3 and row[4] < plan[4]
        for row, plan in zip(r[2 * len(r) // 3:], r[len(r) // 3:]))


def in_blocks(image):
    """The means of two by two pixels each: a draft's noise is no picture."""
    high, wide = image.shape[0] // 2, image.shape[1] // 2
    return image[: 2 * high, : 2 * wide].reshape(high, 2, wide, 2, -1).mean(axis=(1, 3))


class EveryFigure(unittest.TestCase):
    """The figures of a part, made from the repository as it is at draft quality."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory(prefix="polymorph-figures-test-")
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.out = pathlib.Path(cls.temporary.name)
        script = ROOT / "scripts/figures"
        listed = subprocess.run([script, "--list"], capture_output=True, text=True, check=True).stdout
        names = [line.split()[0] for line in listed.splitlines()]
        elsewhere = [name for part in PARTS.values() if part for name in part]
        assert set(elsewhere) <= set(names), "a figure of PARTS that is not there"
        cls.names = PARTS[PART] or [name for name in names if name not in elsewhere]
        # What tests keep for each other is removed before they run together, so that this is what a first run makes.
        cache = {"POLYMORPH_CACHE_DIR": str(pathlib.Path(PROGRAM).resolve().parent / "test-cache/figures")}
        command = [script, cls.out, "--program", PROGRAM, "--blender", "", *(x for name in cls.names for x in ("--only", name))]
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **cache})
        cls.log = done.stdout + done.stderr
        print(cls.log, flush=True)
        assert done.returncode == 0, "scripts/figures failed"
        cls.stamps = {name: json.loads((cls.out / "stamps" / f"{name}.json").read_text(encoding="utf-8")) for name in cls.names}

    def test_each_hands_in_pictures_or_tables_and_words(self):
        page = (self.out / "index.html").read_text(encoding="utf-8")
        for name, stamp in self.stamps.items():
            self.assertTrue(stamp["blocks"], "neither picture nor table")
            self.assertGreater(len(stamp["ours"]), 40)
            self.assertNotRegex(stamp["ours"] + stamp["why"], r"\b(nan|inf|None)\b")
            self.assertIn(f'<section id="{name}">', page)
            self.assertIn(html.escape(stamp["ours"].split("`")[0], quote=False), page)
            for file in stamp["files"]:
                self.assertGreater((self.out / file).stat().st_size, 20, file)

    def test_pictures_show_something(self):
        import matplotlib.image
        for name, stamp in self.stamps.items():
            for block in stamp["blocks"]:
                if block["kind"] != "picture":
                    continue
                self.assertGreater(min(png_size(self.out / block["png"])), 150)
                image = matplotlib.image.imread(self.out / block["png"])[:, :, :3]
                ink = (image.min(axis=2) < 0.97).mean()
                self.assertTrue(0.002 < ink < 0.98, f"{block['png']}: {100 * ink:.2f} % of it is not white")
                for left, top, right, bottom in block.get("panels", []):
                    panel = in_blocks(image[top:bottom, left:right])
                    self.assertGreater(panel.std(axis=(0, 1)).max(), 0.02, f"{block['png']}: the picture at {left}, {top} is empty")
                if "svg" in block:
                    drawn = xml.dom.minidom.parse(str(self.out / block["svg"]))
                    self.assertGreater(len(drawn.getElementsByTagName("path")) + len(drawn.getElementsByTagName("image")), 15)

    def test_numbers_are_whole_and_plausible(self):
        for name, stamp in self.stamps.items():
            for file in (file for file in stamp["files"] if file.endswith(".csv")):
                head, rows = read_rows(self.out / file)
                self.assertTrue(rows, file)
                self.assertEqual({len(row) for row in rows}, {len(head)}, file)
                for cell in (cell for row in rows for cell in row if isinstance(cell, float)):
                    self.assertTrue(math.isfinite(cell), f"{file}: {cell}")
                for column, title in enumerate(head):
                    if re.search(r"\bIoU\b", title):
                        self.assertTrue(all(row[column] is None or 0.4 < row[column] < 1 for row in rows), f"{file}: {title}")
                plausible = NUMBERS.get(file.removesuffix(".csv"))
                if plausible:
                    self.assertTrue(plausible(rows), f"{file}:\n{rows}")

    def test_every_figure_with_a_table_of_its_own_is_looked_at(self):
        known = set(NUMBERS)
        # Weights, states and frames by their names; what a machine measures is checked to be finite alone.
        known |= {"fig5.6", "fig5.13", "fig5.14", "table6.7"}
        for name, stamp in self.stamps.items():
            if any(file.endswith(".csv") for file in stamp["files"]):
                self.assertIn(name, known)


if __name__ == "__main__":
    NEEDED = "import matplotlib, vtkmodules"
    looked = [sys.executable, "/usr/bin/python3"]  # scripts/figures looks in the same places
    able = [p for p in looked if os.path.exists(p) and not subprocess.run([p, "-c", NEEDED], capture_output=True).returncode]
    if not able:
        print("matplotlib or VTK is missing; scripts/setup installs both: skipped")
        sys.exit(77)
    if able[0] != sys.executable:
        os.execv(able[0], [able[0], "-B", *sys.argv])
    unittest.main(argv=sys.argv[:1], defaultTest="EveryFigure" if PART else "Figures")
