#!/usr/bin/env python3
"""Broken files of each format from the boxes beside this: cut off, with bytes turned, with numbers that lie.

make_broken.py FOLDER    writes there; the same files each time.
"""
import pathlib
import random
import sys

here, out = pathlib.Path(__file__).parent, pathlib.Path(sys.argv[1])
out.mkdir(parents=True, exist_ok=True)
for model in sorted(here.glob("box.*")):
    whole = model.read_bytes()
    for share in (0, 3, 10, 25, 50, 75, 90, 99):
        (out / f"cut{share}{model.suffix}").write_bytes(whole[: len(whole) * share // 100])
    for seed in range(12):
        rng = random.Random(f"{model.suffix} {seed}")
        data = bytearray(whole)
        for _ in range(1 + seed):
            data[rng.randrange(len(data))] = rng.choice([0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)])
        (out / f"turned{seed}{model.suffix}").write_bytes(data)
    for seed in range(4):  # four bytes that are a large number or a negative one
        rng = random.Random(f"{model.suffix} number {seed}")
        data, at = bytearray(whole), rng.randrange(len(whole) - 4)
        data[at : at + 4] = rng.choice([b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff", b"\0\0\xc0\x7f", b"9999"])
        (out / f"number{seed}{model.suffix}").write_bytes(data)
    (out / f"text{model.suffix}").write_bytes(b"this is no model\n" * 10)
    (out / f"other{model.suffix}").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256)))
    (out / f"nul{model.suffix}").write_bytes(bytes(4096))
