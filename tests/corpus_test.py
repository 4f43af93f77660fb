"""Every file of tests/data/broken and tests/data/odd, as a user gives it to the program.

broken/expected.tsv: file, exit code, part of what is said about it. odd/expected.tsv: an OBJ that is
unusual but valid: file, points, triangles, shells, closed or open, labels, part of a warning or "-".
Large files are made here. Usage: corpus_test.py PROGRAM
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAM = os.path.abspath(sys.argv.pop(1))
DATA = pathlib.Path(__file__).resolve().parent / "data"
SECONDS = 60  # far more than any takes, for machines under sanitizers or load

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
FACES = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def rows(name):
    for line in (DATA / name / "expected.tsv").read_text().splitlines():
        yield line.split("\t")


class Corpus(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="polymorph-corpus-"))
        self.addCleanup(shutil.rmtree, self.root)
        self.folder = self.root / "work"
        self.folder.mkdir()

    def run_program(self, *words):
        settings = dict(os.environ, POLYMORPH_CACHE_DIR=str(self.root / "cache"))
        ran = subprocess.run([PROGRAM, *words], cwd=self.folder, env=settings, capture_output=True,
                             timeout=SECONDS, stdin=subprocess.DEVNULL)
        for text in (ran.stdout, ran.stderr):
            raw = [b for b in text if b < 32 and b != 10 or b == 127]
            self.assertEqual(raw, [], f"control characters reach the terminal: {words}")
        return ran.returncode, ran.stdout.decode(), ran.stderr.decode()

    def copy(self, name):
        shutil.copytree(DATA / name, self.folder, dirs_exist_ok=True)

    def test_broken(self):
        self.copy("broken")
        before = sorted(p.name for p in self.folder.iterdir())
        count = 0
        for file, code, part in rows("broken"):
            with self.subTest(file):
                command = "check" if file.endswith(".json") else "info"
                got, _, err = self.run_program(command, file)
                self.assertEqual(got, int(code), err)
                self.assertIn(part, err)
                count += 1
        self.assertGreaterEqual(count, 120)
        self.assertEqual(before, sorted(p.name for p in self.folder.iterdir()))

    def test_odd(self):
        self.copy("odd")
        for file, points, triangles, shells, closed, labels, warning in rows("odd"):
            with self.subTest(file):
                got, out, err = self.run_program("info", file, "--json")
                self.assertEqual(got, 0, err)
                said = json.loads(out)
                self.assertEqual((said["points"], said["triangles"], said["shells"]),
                                 (int(points), int(triangles), int(shells)))
                self.assertEqual(said["closed"], closed == "closed")
                self.assertEqual(len(said["labels"]), int(labels))
                if warning == "-":
                    self.assertEqual(err, "")
                else:
                    self.assertIn(warning, err)

    def test_large(self):
        """What is large and made of nothing much: an answer in seconds, whatever it is."""
        many = 300_000
        cases = {
            "words.obj": ("x\n" * 2_000_000, 3, "lines start with an unknown word"),
            "points.obj": ("v 0 0 0\n" * many, 3, "no faces"),
            "one_line.obj": ("f " + "1 " * 2_000_000, 3, "more than 4096 corners"),
            "continued.obj": ("v 0 0 \\\n" * many, 3, "is not a number"),
            "libraries.obj": ("mtllib a.mtl b.mtl\n" + "".join(f"mtllib {i}.mtl\n" for i in range(many)) + TETRAHEDRON + FACES,
                              3, "more than 1000 material libraries"),
            "library_name.obj": ("mtllib " + "a" * 4_000_000 + "\n" + TETRAHEDRON + FACES, 0, "mtllib"),
            "errors.obj": ("v x y z\n" * many, 3, "stopped after 20 errors"),
            "materials.obj": (TETRAHEDRON + "".join(f"usemtl m{i}\nf 1 3 2\n" for i in range(many)), 0,
                              "are there more than once"),
            "deep.json": ("[" * 4_000_000, 1, "nested deeper than 64 levels"),
            "keys.json": ("{" + ",".join(f'"k{i}":1' for i in range(many)) + "}", 1, "unknown key"),
            "actors.json": ('{"actors":[' + ",".join(['{"source":"a","target":"b"}'] * 20_000) + "]}", 1, ""),
            "string.json": ('{"source":"' + "a" * 4_000_000 + '"}', 1, ""),
            "zeros.png": ("\0" * 4_000_000, 3, ""),
            "text.ply": ("ply\n" + "element vertex 1\n" * many, 3, ""),
        }
        for file, (text, code, part) in cases.items():
            with self.subTest(file):
                (self.folder / file).write_text(text)
                got, out, err = self.run_program("check" if file.endswith(".json") else "info", file)
                self.assertEqual(got, code, err[:2000])
                self.assertIn(part, err)
                self.assertLess(len(err), 100_000)

    def test_what_is_no_file(self):
        """Nothing waits for a pipe or reads a device without end, and what is too large is not read at all."""
        os.mkfifo(self.folder / "pipe.obj")
        os.mkfifo(self.folder / "pipe.mtl")
        os.mkfifo(self.folder / "pipe.png")
        (self.folder / "folder.obj").mkdir()
        (self.folder / "zero.obj").symlink_to("/dev/zero")
        with open(self.folder / "large.obj", "wb") as large:
            large.truncate(3 << 30)
        (self.folder / "cube.mtl").write_text("newmtl a\nmap_Kd pipe.png\n")
        for library in ("pipe.mtl", "cube.mtl"):
            (self.folder / f"{library}.obj").write_text(f"mtllib {library}\n{TETRAHEDRON}usemtl a\n{FACES}")
        for file, code, part in [("pipe.obj", 3, "is not a regular file"), ("zero.obj", 3, "is not a regular file"),
                                 ("folder.obj", 3, "is a directory"), ("large.obj", 3, "is too large"),
                                 ("pipe.mtl.obj", 0, 'mtllib "pipe.mtl"'), ("cube.mtl.obj", 0, "pipe.png")]:
            with self.subTest(file):
                got, _, err = self.run_program("info", file)
                self.assertEqual(got, code, err)
                self.assertIn(part, err)

    def test_names(self):
        """Any name that a file system takes is one for frames; in a pattern the last run of # is the number."""
        scene = {"source": {"model": "my cube%d#1.obj"}, "target": {"shape": "sphere"}, "frames": {"count": 2},
                 "spheres": {"balls": 4, "fit": "none"}, "surface": {"resolution": 16},
                 "image": {"width": 16, "height": 12, "samples": 1}}
        (self.folder / "my cube%d#1.obj").write_text(TETRAHEDRON + FACES)
        (self.folder / "my scene.json").write_text(json.dumps(scene))
        names = {"with blanks ####.png": b"with blanks 0001.png", "per%%cent####.png": b"per%cent0001.png",
                 "quote'\"####.png": b"quote'\"0001.png", "-dash####.png": b"-dash0001.png",
                 "umlaut\u00e4####.png": "umlaut\u00e40001.png".encode(),
                 b"latin\xe4####.png".decode("utf-8", "surrogateescape"): b"latin\xe40001.png",
                 "line\nbreak####.png": b"line\nbreak0001.png", "a folder/####.png": b"a folder/0001.png"}
        for name, file in names.items():
            with self.subTest(name):
                got, _, err = self.run_program("render", "my scene.json", "-f", "1", f"--output={name}", "--device", "cpu")
                self.assertEqual(got, 0, err)
                self.assertTrue((self.folder / os.fsdecode(file)).is_file())
        for name in ("##/####.png", "per%cent####.png", "##.####.png"):
            got, _, err = self.run_program("render", "my scene.json", "-o", name)
            self.assertEqual(got, 2, err)


if __name__ == "__main__":
    unittest.main()
