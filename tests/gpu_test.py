#!/usr/bin/env python3
"""scripts/gpu where there is no GPU: with --cpu, and with a program that says it had one.

gpu_test.py PROGRAM
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
os.environ.pop("CI", None)  # golden update refuses to write where it is set
PROGRAM = pathlib.Path(sys.argv.pop(1)).absolute()
SCENE = {"source": "cube", "target": "sphere", "spheres": {"balls": 8, "fit": "none"}, "frames": {"count": 4},
         "surface": {"resolution": 16}, "image": {"width": 32, "height": 24, "samples": 1}}
BLEND = {key: value for key, value in SCENE.items() if key not in ("source", "target")} | {
    "blend": [{"model": "../models/cube.obj", "weight": 1, "spheres": {"balls": 8}}, {"model": "../models/cube.obj", "spheres": {"balls": 8}, "scale": 0.5, "weight": 2}]}
# Has a GPU by its own account, and makes surfaces in other cells on it where $OTHER is set.
WITH_GPU = f"""#!/bin/bash
if [[ $1 == devices ]]; then echo '{{"cpu": {{"name": "a processor"}}, "built_with_cuda": true, "cuda": [{{"name": "a GPU"}}]}}'; exit; fi
if [[ $POLYMORPH_DEVICE == cuda && $1 == mesh && -n $OTHER ]]; then set -- "$@" --set surface.resolution=12; fi
if [[ $POLYMORPH_DEVICE == cuda && $1 == golden && -n $LEAVES ]]; then echo "the CPU traces frames that the GPU cannot: a reason" >&2; fi
POLYMORPH_DEVICE=cpu exec {PROGRAM} "$@"
"""
TESTS = """#!/bin/bash
[[ -n $POLYMORPH_REQUIRE_CUDA || -z $NEEDED ]] || { echo '[  FAILED  ] 1 test'; exit 1; }
echo '[==========] 7 tests from 2 test suites ran. (1 ms total)'
[[ -z $SKIPS ]] || echo '[  SKIPPED ] 2 tests, listed below:'
"""
CONTRACTED = "#!/bin/bash\necho '[  FAILED  ] ScalarTracer.StudioHasTheSameBits'; exit 1\n"


class Gpu(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory(prefix="polymorph-gpu-")
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = pathlib.Path(temporary.name)
        cls.copy = cls.folder / "repository"
        shutil.copytree(ROOT / "scripts", cls.copy / "scripts", ignore=shutil.ignore_patterns("__pycache__"))
        for place in ("scenes/standard", "scenes/models", "golden_frames/suite"):
            (cls.copy / place).mkdir(parents=True)
        for file in (ROOT / "scenes/models").glob("cube.*"):
            shutil.copy(file, cls.copy / "scenes/models")
        for name in ("one", "two"):
            (cls.copy / f"scenes/standard/{name}.json").write_text(json.dumps(SCENE))
        (cls.copy / "scenes/standard/blend.json").write_text(json.dumps(BLEND))
        (cls.copy / "golden_frames/suite/suite.json").write_text(json.dumps({"scene": "../../scenes/standard/one.json", "frames": [1, 3]}))
        subprocess.run([PROGRAM, "golden", "update", "suite", "--root", cls.copy / "golden_frames", "--reason", "first", "-q"], check=True, capture_output=True)
        cls.programs = cls.folder / "programs"
        cls.programs.mkdir()
        for name, text in (("polymorph", WITH_GPU), ("test_backend", TESTS), ("test_render", TESTS), ("contracted", CONTRACTED)):
            (cls.programs / name).write_text(text)
            (cls.programs / name).chmod(0o755)

    def run_gpu(self, *arguments, code=0, **variables):
        """The table: result and last words of each step."""
        command = [self.copy / "scripts/gpu", "--out", self.folder / "out", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, env=os.environ | variables)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.said = done.stdout + done.stderr
        table = done.stdout.partition("what\n")[2].partition("\n\n")[0]
        return {name: (result, what) for name, result, what in re.findall(r"^(\w+) +(pass|FAIL|UNABLE|left out) +[\d.]+  (.*)$", table, re.M)}

    def test_without_a_gpu_it_says_what_it_would_do(self):
        self.run_gpu("--program", PROGRAM, code=5)
        for words in ("no GPU can be used here", "golden", "surfaces", "figures", "analyze_flat", "--cpu"):
            self.assertIn(words, self.said)

    def test_the_cpu_in_its_place(self):
        table = self.run_gpu("--cpu", "--program", PROGRAM, "--backend", self.programs / "test_backend",
                             "--tracer", self.programs / "test_render", "--contracted", self.programs / "contracted", "--figure", "fig5.6")
        self.assertEqual({result for result, _ in table.values()}, {"pass"}, self.said)
        self.assertEqual(list(table), ["backend", "tracing", "contraction", "golden", "surfaces", "analyze_flat", "analyze_midpoint", "frames", "figures"])
        words = {name: what for name, (_, what) in table.items()}
        self.assertEqual(words["backend"], "7 tests")
        self.assertEqual(words["tracing"], "7 tests")
        self.assertIn("2 frames", words["golden"])
        self.assertEqual(words["surfaces"], "12 frames of 3 scenes are equal")
        self.assertEqual(words["frames"], "9 frames are equal")
        self.assertIn("1 made", words["figures"])
        self.assertTrue((self.folder / "out/figures/fig5.6.png").exists())

    def test_what_differs_fails(self):
        table = self.run_gpu("--program", self.programs / "polymorph", "--skip", "contraction,figures,golden,analyze_flat,analyze_midpoint", NEEDED="1", OTHER="1", code=1)
        self.assertEqual([table[name][0] for name in ("backend", "tracing", "golden", "surfaces", "frames")], ["pass", "pass", "left out", "FAIL", "pass"], self.said)
        self.assertIn("other surfaces than on the CPU: blend one two", self.said)
        self.assertIn("DIFFERS", (self.folder / "out/surfaces.log").read_text())

    def test_frames_that_are_left_to_the_cpu_fail(self):
        table = self.run_gpu("--program", self.programs / "polymorph", "--only", "golden,frames", "--scenes", "one.json", LEAVES="1", code=1)
        self.assertEqual([table[name][0] for name in ("golden", "frames")], ["FAIL", "FAIL"], self.said)
        self.assertIn("left work to the CPU", self.said)

    def test_a_contracted_tracer_that_passes_fails(self):
        words = ["--program", self.programs / "polymorph", "--only", "contraction"]
        table = self.run_gpu(*words, "--contracted", self.programs / "test_render", code=1)
        self.assertEqual(table["contraction"][0], "FAIL")
        self.assertEqual(self.run_gpu(*words, code=1)["contraction"][0], "UNABLE")

    def test_a_test_that_is_skipped_fails(self):
        table = self.run_gpu("--program", self.programs / "polymorph", "--only", "backend,tracing", SKIPS="1", code=1)
        self.assertEqual([table[name][0] for name in ("backend", "tracing")], ["FAIL", "FAIL"])

    def test_a_golden_that_differs_fails(self):
        suite = self.copy / "golden_frames/suite"
        frame = (suite / "frame.0001.exr").read_bytes()
        shutil.copy(suite / "frame.0003.exr", suite / "frame.0001.exr")
        self.addCleanup((suite / "frame.0001.exr").write_bytes, frame)
        table = self.run_gpu("--program", self.programs / "polymorph", "--only", "golden", code=1)
        self.assertEqual(table["golden"][0], "FAIL")

    def test_what_is_missing_is_said(self):
        alone = self.folder / "alone"
        alone.mkdir()
        shutil.copy(self.programs / "polymorph", alone)
        table = self.run_gpu("--program", alone / "polymorph", "--only", "backend,tracing", code=1)
        self.assertEqual([table[name][0] for name in ("backend", "tracing")], ["UNABLE", "UNABLE"])
        self.run_gpu("--program", self.folder / "nothing", code=2)
        self.run_gpu("--only", "pictures", "--program", PROGRAM, code=2)


if __name__ == "__main__":
    unittest.main()
