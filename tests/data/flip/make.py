#!/usr/bin/env python3
"""Writes the pictures of this folder and values.json: what NVIDIA's FLIP says about each against reference.png.

    pip install numpy flip-evaluator==1.7 && python3 make.py

Run once; the files are kept, so that the tests need neither. LDR-FLIP, 67.02 pixels a degree (its default).
"""
import json
import pathlib
import re
import struct
import zlib

import flip_evaluator
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
WIDTH, HEIGHT = 80, 60


def write_png(path, codes):
    rows = b"".join(b"\0" + row.tobytes() for row in codes)
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 2, 0, 0, 0))
                     + chunk(b"sRGB", b"\0") + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def reference():
    """A shaded ball on a checkered ground under a sky, thin lines, a saturated patch."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    picture = np.stack([0.25 + 0.004 * y, 0.45 + 0.005 * y, 0.8 + 0.002 * y], -1)
    checks = ((x // 7 + y // 5) % 2)[..., None]
    picture = np.where((y > 38)[..., None], 0.25 + 0.4 * checks * np.array([1, 0.9, 0.7]), picture)
    dx, dy = (x - 34) / 19, (y - 28) / 19
    z = np.sqrt(np.clip(1 - dx * dx - dy * dy, 0, 1))
    light = np.clip(0.5 * z - 0.5 * dx - 0.6 * dy, 0, 1)
    ball = light[..., None] * np.array([0.95, 0.6, 0.2]) + 0.05
    picture = np.where((z > 0)[..., None], ball, picture)
    picture[(x > 60) & (y < 16) & (y > 4)] = [0.05, 0.75, 0.1]
    picture[(x > 66) & (x < 74) & (y > 7) & (y < 13)] = [0.1, 0.05, 0.9]
    picture[(x == 5) | (y == 3)] = 0.95
    return picture


def damaged(picture):
    rng = np.random.default_rng(1)
    shifted = picture.copy()
    shifted[:, 1:] = picture[:, :-1]
    firefly = picture.copy()
    firefly[30, 50] = 1
    yield "black", np.zeros_like(picture)
    yield "shifted", shifted
    yield "firefly", firefly
    yield "swapped", picture[..., ::-1]
    yield "gamma", picture ** (1 / 1.2)
    yield "noise_1", picture + rng.integers(-1, 2, picture.shape) / 255
    yield "noise_10", picture + rng.integers(-10, 11, picture.shape) / 255
    yield "same", picture


def codes_of(picture):
    return np.clip(np.rint(picture * 255), 0, 255).astype(np.uint8)


def figures(actual, reference):
    as_floats = lambda codes: codes.astype(np.float32) / np.float32(255)
    error, mean, parameters = flip_evaluator.evaluate(as_floats(reference), as_floats(actual), "LDR", applyMagma=False)
    error = np.asarray(error).reshape(HEIGHT, WIDTH, -1)[..., 0].astype(np.float64)
    points = [[int(x), int(y), round(float(error[y, x]), 6)] for y in range(0, HEIGHT, 8) for x in range(0, WIDTH, 8)]
    return {"mean": round(float(error.mean()), 6), "max": round(float(error.max()), 6),
            "p99": round(float(np.sort(error, axis=None)[int(np.ceil(0.99 * error.size)) - 1]), 6),
            "pixels_per_degree": round(float(parameters["ppd"]), 6), "points": points}


first = codes_of(reference())
write_png(HERE / "reference.png", first)
values = {"made_with": "flip-evaluator 1.7", "pictures": {}}
for name, picture in damaged(reference()):
    codes = codes_of(picture)
    if name != "same":
        write_png(HERE / f"{name}.png", codes)
    values["pictures"][name] = figures(codes, first)
    print(name, {k: v for k, v in values["pictures"][name].items() if k != "points"})
text = json.dumps(values, indent=1)
(HERE / "values.json").write_text(re.sub(r"\[\s+(\d+),\s+(\d+),\s+([\d.e-]+)\s+\]", r"[\1, \2, \3]", text) + "\n")
