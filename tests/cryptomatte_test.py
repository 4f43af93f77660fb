#!/usr/bin/env python3
"""Cryptomattes of rendered frames, decoded by a reader that shares no code with the program.

cryptomatte_test.py PROGRAM      PROGRAM: polymorph
"""

import json
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest

from exr import Exr

PROGRAM = sys.argv.pop()
LAYERS = ["crypto_object", "crypto_material", "crypto_label"]
SCENE = {
    "actors": [
        {"name": "glass", "source": {"shape": "cube", "glass": 1, "roughness": 0}, "target": "torus"},
        {"name": "red", "source": {"shape": "sphere", "color": "#ff0000"}, "target": "cube", "translate": [1.2, 0, -0.5]},
    ],
    "spheres": {"balls": 16, "fit": "none"},
    "motion": {"interpolate": "balls"},
    "surface": {"resolution": 24},
    "frames": {"count": 6},
    "camera": {"shutter": 1, "aperture": 0.2, "orbit": 40},
    "image": {"width": 96, "height": 72, "samples": 16, "aovs": ",".join(LAYERS)},
}


def murmur3_32(text):
    """MurmurHash3_x86_32 with seed 0, after its description."""
    data, h = text.encode(), 0
    rotl = lambda x, r: ((x << r) | (x >> (32 - r))) & 0xFFFFFFFF
    mixed = lambda k: rotl(k * 0xCC9E2D51 & 0xFFFFFFFF, 15) * 0x1B873593 & 0xFFFFFFFF
    whole = len(data) // 4 * 4
    for i in range(0, whole, 4):
        h = (rotl(h ^ mixed(int.from_bytes(data[i : i + 4], "little")), 13) * 5 + 0xE6546B64) & 0xFFFFFFFF
    h ^= mixed(int.from_bytes(data[whole:], "little")) ^ len(data)
    h = (h ^ (h >> 16)) * 0x85EBCA6B & 0xFFFFFFFF
    h = (h ^ (h >> 13)) * 0xC2B2AE35 & 0xFFFFFFFF
    return h ^ (h >> 16)


def float_id(name):
    bits = murmur3_32(name)
    if (bits >> 23) & 255 in (0, 255):
        bits ^= 1 << 23
    return struct.unpack("<f", struct.pack("<I", bits))[0]


def mattes(exr, layer):
    """Coverage of each name of a layer's manifest, pixel by pixel."""
    key = f"{murmur3_32(layer):08x}"[:7]
    texts = {name.split("/")[2]: text for name, text in exr.texts.items() if name.startswith(f"cryptomatte/{key}/")}
    assert texts["name"] == layer and texts["hash"] == "MurmurHash3_32" and texts["conversion"] == "uint32_to_float32"
    ids = {}
    for name, digits in json.loads(texts["manifest"]).items():
        (ids[name],) = struct.unpack("<f", struct.pack("<I", int(digits, 16)))
        assert ids[name] == float_id(name), name
    result = {name: [0.0] * (exr.width * exr.height) for name in ids}
    names = {value: name for name, value in ids.items()}
    for group in ("00", "01", "02"):
        for first, second in ("RG", "BA"):
            pairs = zip(exr.pixels(f"{layer}{group}.{first}"), exr.pixels(f"{layer}{group}.{second}"))
            for i, (matte, coverage) in enumerate(pairs):
                if coverage > 0:
                    result[names[matte]][i] += coverage
    return result


class Cryptomatte(unittest.TestCase):
    def render(self, changes, look=lambda folder, exr: None):
        scene = json.loads(json.dumps(SCENE))
        for key, value in changes.items():
            scene["image"][key] = value
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder)
            (path / "scene.json").write_text(json.dumps(scene))
            subprocess.run(
                [PROGRAM, "render", "scene.json", "-f", "3", "-o", "f.exr", "--no-cache", "--quiet"],
                cwd=folder, check=True)
            exr = Exr(path / "f.exr")
            look(path, exr)
            return exr

    def test_coverages_sum_to_one_under_lens_shutter_and_glass(self):
        exr = self.render({})
        for layer in LAYERS:
            decoded = mattes(exr, layer)
            sums = [sum(values) for values in zip(*decoded.values())]
            self.assertLess(max(abs(s - 1) for s in sums), 1e-3, layer)
            partly = sum(any(0.01 < c < 0.99 for c in values) for values in zip(*decoded.values()))
            self.assertGreater(partly, 300, "edges are smeared")
        objects = mattes(exr, "crypto_object")
        self.assertEqual(set(objects), {"glass", "red", "ground", "backdrop"})
        for name in objects:
            self.assertGreater(sum(objects[name]), 50, name)

    def test_with_a_transparent_backdrop_they_sum_to_alpha(self):
        # Alpha sees through glass, a matte does not; so the glass is left out here.
        SCENE["actors"][0]["source"]["glass"] = 0
        exr = self.render({"transparent": True})
        alpha = exr.pixels("A")
        for layer in LAYERS:
            decoded = mattes(exr, layer)
            for values, a in zip(zip(*decoded.values()), alpha):
                self.assertLess(abs(sum(values) - a), 1e-3, layer)
        self.assertGreater(sum(0.01 < a < 0.99 for a in alpha), 100)

    def test_strip_writes_the_matte_of_a_name(self):
        self.render({}, self.compare_with_strip)

    def compare_with_strip(self, folder, exr):
        strip = lambda *words: subprocess.run(
            [PROGRAM, "strip", *words], cwd=folder, capture_output=True, text=True)
        for name in ["red", "glass", "ground", "backdrop"]:
            ran = strip("f.exr", "--matte", name, "-o", f"{name}.exr")
            self.assertEqual((ran.returncode, ran.stdout), (0, f"{name}.exr\n"), ran.stderr)
            matte, known = Exr(folder / f"{name}.exr"), mattes(exr, "crypto_object")[name]
            for channel in "RGB":  # half floats
                self.assertLess(max(abs(a - b) for a, b in zip(matte.pixels(channel), known)), 5e-4)
        ran = strip("f.exr", "--matte", "rad", "-o", "x.png")
        self.assertEqual(ran.returncode, 2)
        for words in ['no matte is called "rad"', 'did you mean "red"', '"glass"', '"ground"', '"backdrop"']:
            self.assertIn(words, ran.stderr)
        for words in [["-o", "red.exr"], ["-o", "f.exr", "--overwrite"]]:  # a file that is there, and the frame itself
            self.assertEqual(strip("f.exr", "--matte", "red", *words).returncode, 4, words)
        self.assertEqual(strip("scene.json", "--matte", "red", "-o", "x.png").returncode, 2)
        # Of a sequence: a sheet, or a picture each.
        (folder / "g.0001.exr").write_bytes((folder / "f.exr").read_bytes())
        (folder / "g.0002.exr").write_bytes((folder / "f.exr").read_bytes())
        self.assertEqual(strip("g.####.exr", "--matte", "red", "-o", "sheet.png").returncode, 0)
        ran = strip("g.####.exr", "--matte", "red", "-o", "red.####.exr")
        self.assertEqual(ran.stdout, "red.0001.exr\nred.0002.exr\n", ran.stderr)
        self.assertEqual((folder / "red.0002.exr").read_bytes(), (folder / "red.exr").read_bytes())
        self.assertEqual(strip("f.exr", "--matte", "red", "-o", "red.##.png").returncode, 2)


if __name__ == "__main__":
    unittest.main()
