"""The scenes of README.md and docs/, and the commands of README.md, do what the pages say, typed as they stand.

Every ```json block with a scene is saved beside the models that come with the program and checked;
every line of a ```sh block of the README that starts with "polymorph" is run, block by block, in a
folder with first.obj and second.obj. Blocks that install or build are left to the tests of those.
Usage: readme_test.py PROGRAM
"""

import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAM = os.path.abspath(sys.argv.pop(1))
ROOT = pathlib.Path(__file__).resolve().parent.parent
MODELS = ROOT / "scenes" / "models"
# What a command does is tested, not how its pictures look.
QUICK = '[render]\npreview = true\n[strip]\npreview = true\n'


def blocks(page, kind):
    return re.findall(rf"^```{kind}\n(.*?)^```", page.read_text(), re.M | re.S)


class Readme(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="polymorph-readme-"))
        self.addCleanup(shutil.rmtree, self.root)
        self.folder = self.root / "work"
        shutil.copytree(MODELS, self.folder)
        shutil.copy(MODELS / "torus.obj", self.folder / "first.obj")
        shutil.copy(MODELS / "cube.obj", self.folder / "second.obj")
        (self.root / "quick.toml").write_text(QUICK)
        (self.root / "bin").mkdir()
        (self.root / "bin" / "polymorph").symlink_to(PROGRAM)
        self.settings = dict(os.environ, POLYMORPH_CACHE_DIR=str(self.root / "cache"),
                             POLYMORPH_CONFIG=str(self.root / "quick.toml"),
                             PATH=f"{self.root / 'bin'}:{os.environ['PATH']}")

    def run_line(self, line):
        ran = subprocess.run(["bash", "-c", line], cwd=self.folder, env=self.settings,
                             capture_output=True, text=True, timeout=600, stdin=subprocess.DEVNULL)
        self.assertEqual(ran.returncode, 0, f"{line}\n{ran.stdout}{ran.stderr}")

    def test_scenes(self):
        count = 0
        for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
            for text in blocks(page, "json"):
                with self.subTest(page=page.name, text=text):
                    said = json.loads(text)
                    if "source" not in said and "actors" not in said:
                        continue  # a golden suite's
                    (self.folder / "snippet.json").write_text(text)
                    self.run_line("polymorph check snippet.json")
                    count += 1
        self.assertGreaterEqual(count, 5)

    def test_commands(self):
        ran = 0
        for text in blocks(ROOT / "README.md", "sh"):
            lines = [line for line in text.splitlines() if line.strip()]
            if not all(line.startswith("polymorph ") for line in lines):
                continue
            for line in lines:
                with self.subTest(line):
                    shlex.split(line, comments=True)
                    self.run_line(line)
                    ran += 1
        self.assertGreaterEqual(ran, 8)


if __name__ == "__main__":
    unittest.main()
