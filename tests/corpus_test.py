"""Every file of tests/data/broken and tests/data/odd, as a user gives it to the program.

broken/expected.tsv: file, exit code, part of what is said about it. odd/expected.tsv: an OBJ that is
unusual but valid: file, points, triangles, shells, closed or open, labels, part of a warning or "-".
Large files are made here. Usage: corpus_test.py PROGRAM
"""

import json
import os
import pathlib
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

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

    def run_and_measure(self, *words):
        """Exit code, standard error and the most memory in MB, that of child processes too."""
        program = subprocess.Popen([PROGRAM, *words], cwd=self.folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, env=dict(os.environ, POLYMORPH_CACHE_DIR=str(self.root / "cache")))
        err = program.stderr.read().decode()
        program.stderr.close()
        _, status, usage = os.wait4(program.pid, 0)
        program.returncode = os.waitstatus_to_exitcode(status)
        return program.returncode, err, usage.ru_maxrss // 1024

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

    def test_headers_that_claim_much(self):
        """No memory is taken for what a header only claims to hold."""
        def chunk(kind, data):
            return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

        def png(width, height, depth, kind):
            return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0))
                    + chunk(b"IDAT", zlib.compress(bytes(10))) + chunk(b"IEND", b""))

        frame = struct.pack(">HBHHB", 17, 8, 65500, 65500, 3) + b"\1\x22\0\2\x11\0\3\x11\0"
        jpeg = (b"\xff\xd8\xff\xdb" + struct.pack(">HB", 67, 0) + b"\1" * 64 + b"\xff\xc2" + frame
                + b"\xff\xc4" + struct.pack(">HB", 20, 0) + b"\1" + bytes(16)
                + b"\xff\xda" + struct.pack(">HB", 12, 3) + b"\1\0\2\0\3\0\0\0\0" + bytes(20) + b"\xff\xd9")
        tags = [(256, 16), (257, 16), (258, 8), (259, 1), (262, 2), (277, 3), (322, 60000), (323, 6000), (324, 8), (325, 4)]
        tiff = (b"II*\0" + struct.pack("<I", 16) + bytes(8) + struct.pack("<H", len(tags))
                + b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags) + bytes(4))
        files = {"row.png": png(2**31 - 1, 1, 8, 2), "rows.png": png(100_000_000, 10, 16, 6), "progressive.jpg": jpeg, "tile.tif": tiff}
        for file, data in files.items():
            with self.subTest(file):
                (self.folder / file).write_bytes(data)
                code, err, memory = self.run_and_measure("info", file)
                self.assertEqual(code, 3, err)
                self.assertIn("more than the limit of 1.1 GB", err)
                self.assertLess(memory, 600)
        # A limit of the process counts, too: 5000 x 5000 pixels are 300 MB as floats.
        (self.folder / "square.png").write_bytes(png(5000, 5000, 8, 2))
        code, err, memory = self.run_and_measure("info", "square.png", "--max-memory", "250M")
        self.assertEqual(code, 5, err)
        self.assertIn("the memory limit leaves", err)
        self.assertLess(memory, 600)

    def test_instances(self):
        """What a small file unpacks to is counted before it is unpacked."""
        points = b"".join(struct.pack("<3f", x % 60, x // 60, x % 7) for x in range(3600))
        faces = b"".join(struct.pack("<3H", x, x + 1, x + 60) for x in range(3500))
        (self.folder / "model.bin").write_bytes(points + faces)
        model = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(3000))}], "nodes": [{"mesh": 0}] * 3000,
                 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3600, "type": "VEC3", "min": [0, 0, 0], "max": [59, 59, 6]},
                               {"bufferView": 1, "componentType": 5123, "count": 10500, "type": "SCALAR"}],
                 "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(points)},
                                 {"buffer": 0, "byteOffset": len(points), "byteLength": len(faces)}],
                 "buffers": [{"byteLength": len(points) + len(faces), "uri": "model.bin"}]}
        (self.folder / "model.gltf").write_text(json.dumps(model))
        scene = {"source": "model.gltf", "target": "cube", "image": {"width": 16, "height": 12}}
        (self.folder / "scene.json").write_text(json.dumps(scene))
        for words in (["info", "model.gltf"], ["render", "scene.json", "-f", "1", "-o", "f.exr"]):
            code, err, memory = self.run_and_measure(*words, "--max-memory", "300M")
            self.assertEqual(code, 5, err)
            self.assertIn("it unpacks to 10800000 points and 10500000 faces", err)
            self.assertLess(memory, 300)

    def test_links(self):
        """Files that a model names are read in its folder, wherever links lead."""
        outside = self.root / "outside"
        outside.mkdir()
        (outside / "secret.mtl").write_text("newmtl a\nKd 0 1 0\n")
        (self.folder / "link.mtl").symlink_to(outside / "secret.mtl")
        (self.folder / "folder").symlink_to(outside)
        (self.folder / "own.mtl").write_text("newmtl a\nKd 0 1 0\nmap_Kd picture.png\n")
        (outside / "picture.png").write_bytes(b"")
        (self.folder / "picture.png").symlink_to(outside / "picture.png")
        (self.folder / "same.mtl").symlink_to("own.mtl")
        for library, code, part in [("link.mtl", 3, "a link that leads outside"), ("folder/secret.mtl", 3, "a link that leads outside"),
                                    ("own.mtl", 0, "a link that leads outside"), ("same.mtl", 0, "a link that leads outside")]:
            with self.subTest(library):
                (self.folder / "m.obj").write_text(f"mtllib {library}\n{TETRAHEDRON}vt 0 0\nusemtl a\n"
                                                   + "f 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 2/1 3/1 4/1\nf 1/1 4/1 3/1\n")
                got, _, err = self.run_program("info", "m.obj")
                self.assertEqual(got, code, err)
                self.assertIn(part, err)

    def test_linked_model(self):
        """A model and its library may be links into one folder elsewhere."""
        outside = self.root / "library"
        outside.mkdir()
        (outside / "m.mtl").write_text("newmtl a\nKd 0 1 0\n")
        (outside / "m.obj").write_text(f"mtllib m.mtl\nusemtl a\n{TETRAHEDRON}f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
        for name in ["m.obj", "m.mtl"]:
            (self.folder / name).symlink_to(outside / name)
        code, _, err = self.run_program("info", "m.obj")
        self.assertEqual(code, 0, err)
        self.assertNotIn("link", err)

    def test_small_stack(self):
        """A stack that is too small is raised, or an error."""
        def limit(most):
            return lambda: resource.setrlimit(resource.RLIMIT_STACK, (65536, most))

        scene = {"source": "cube", "target": "sphere", "spheres": {"balls": 4}, "surface": {"resolution": 16}}
        (self.folder / "scene.json").write_text(json.dumps(scene))
        _, most = resource.getrlimit(resource.RLIMIT_STACK)
        for maximum, code, part in [(65536, 5, b"error: the stack is limited to 66 kB"), (most, 0, b"m.obj")]:
            ran = subprocess.run([PROGRAM, "mesh", "scene.json", "-f", "2", "-o", "m.obj", "--no-cache"], cwd=self.folder,
                                 capture_output=True, timeout=SECONDS, stdin=subprocess.DEVNULL, preexec_fn=limit(maximum))
            self.assertEqual(ran.returncode, code, ran.stderr)
            self.assertIn(part, ran.stdout + ran.stderr)

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
