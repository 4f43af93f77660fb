#!/usr/bin/env python3
"""image.denoise with and without Open Image Denoise.

denoise_test.py PROGRAM FOLDER      PROGRAM: polymorph; FOLDER: where a library that had to be fetched is kept

The library is the one that POLYMORPH_OIDN names, else that of the PyPI wheel pyoidn. Exit code 77: there is none.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import zipfile

from exr import Exr

FOLDER = pathlib.Path(sys.argv.pop())
PROGRAM = sys.argv.pop()
SCENE = {
    "source": {"shape": "cube", "color": "#b03020"},
    "target": {"shape": "torus", "metallic": 1, "roughness": 0.1},
    "spheres": {"balls": 16, "fit": "none"},
    "motion": {"interpolate": "balls"},
    "surface": {"resolution": 24},
    "frames": {"count": 6},
    "image": {"width": 128, "height": 96, "samples": 4},
}


def find_library():
    """The library's path, or why there is none."""
    if os.environ.get("POLYMORPH_OIDN"):
        return pathlib.Path(os.environ["POLYMORPH_OIDN"]), ""
    kept = FOLDER / "pyoidn/oidn/lib/libOpenImageDenoise.so.2"
    if kept.exists():
        return kept, ""
    FOLDER.mkdir(parents=True, exist_ok=True)
    fetch = [sys.executable, "-m", "pip", "download", "--no-deps", "--only-binary", ":all:", "pyoidn", "-d", str(FOLDER)]
    try:
        subprocess.run(fetch, check=True, capture_output=True, timeout=300)
        for wheel in FOLDER.glob("pyoidn-*.whl"):
            zipfile.ZipFile(wheel).extractall(FOLDER)
            wheel.unlink()
    except (subprocess.SubprocessError, OSError) as reason:
        return None, f"pip cannot fetch pyoidn ({reason})"
    return (kept, "") if kept.exists() else (None, "the wheel pyoidn has no libOpenImageDenoise.so.2 for this machine")


LIBRARY, REASON = find_library()


class Denoise(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name)
        (self.path / "scene.json").write_text(json.dumps(SCENE))

    def tearDown(self):
        self.folder.cleanup()

    def run_program(self, arguments, library):
        environment = dict(os.environ, POLYMORPH_OIDN=str(library))
        return subprocess.run([PROGRAM] + arguments, cwd=self.path, env=environment, capture_output=True, text=True)

    def render(self, name, arguments, library=LIBRARY):
        done = self.run_program(["render", "scene.json", "-f", "3", "-o", name, "--no-cache"] + arguments, library)
        self.assertEqual(done.returncode, 0, done.stderr)
        return Exr(self.path / name)

    @staticmethod
    def distance(picture, clean):
        """Root of the mean square of what the colours differ by."""
        squares = [(a - b) ** 2 for c in "RGB" for a, b in zip(picture.pixels(c), clean.pixels(c))]
        return (sum(squares) / len(squares)) ** 0.5

    def test_without_the_library_one_line_says_how_to_get_it(self):
        done = self.run_program(["render", "scene.json", "-o", "f.exr", "--set", "image.denoise=true"], "/nowhere/oidn.so")
        self.assertEqual(done.returncode, 5)
        for word in ("/nowhere/oidn.so", "pip install pyoidn", "POLYMORPH_OIDN", "image.denoise"):
            self.assertIn(word, done.stderr)
        self.assertEqual(list(self.path.glob("*.exr")), [])

    @unittest.skipIf(LIBRARY is None, REASON)
    def test_noise_goes_and_the_rest_stays(self):
        clean = self.render("clean.exr", ["--spp", "512"])
        noisy = self.render("noisy.exr", ["--set", "image.aovs=all"])
        denoised = self.render("denoised.exr", ["--set", "image.aovs=all", "--set", "image.denoise=true"])
        self.assertEqual(set(noisy.channels), set(denoised.channels), "no guides are left behind")
        for channel in noisy.channels:
            same = noisy.channels[channel] == denoised.channels[channel]
            self.assertEqual(same, channel not in "RGB", channel)
        self.assertLess(self.distance(denoised, clean), 0.5 * self.distance(noisy, clean))
        again = self.render("again.exr", ["--set", "image.aovs=all", "--set", "image.denoise=true"])
        self.assertEqual(again.channels, denoised.channels, "the same pixels every time")


if __name__ == "__main__":
    done = unittest.main(exit=False).result
    if LIBRARY is None:
        print(f"SKIPPED: image.denoise was not tried with a library: {REASON}", file=sys.stderr)
    sys.exit(1 if not done.wasSuccessful() else 77 if LIBRARY is None else 0)
