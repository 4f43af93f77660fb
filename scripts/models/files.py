"""Writes OBJ, MTL and PNG files.  The same input gives the same bytes."""
import struct
import zlib
import numpy as np


def number(x, digits):
    """Formats a number without trailing zeros."""
    s = "%.*f" % (digits, x)
    if "." in s:
        s = s.rstrip("0").rstrip(".")
    return "0" if s == "-0" else s


def write_obj(path, title, mtl, v, faces, groups, normals, normal_of, uv=None, uv_of=None):
    """groups: list of (name, material, face indices).  normal_of and uv_of: indices per face corner."""
    out = ["# " + t for t in title] + ["mtllib " + mtl]
    out += ["v %s %s %s" % tuple(number(c, 5) for c in p) for p in v.tolist()]
    if uv is not None:
        out += ["vt %s %s" % tuple(number(c, 5) for c in p) for p in uv.tolist()]
    out += ["vn %s %s %s" % tuple(number(c, 4) for c in p) for p in normals.tolist()]
    for name, material, ids in groups:
        if len(ids) == 0:
            continue
        out += ["g " + name, "usemtl " + material, "s 1"]
        for f in ids:
            a, n = faces[f] + 1, normal_of[f] + 1
            if uv is None:
                out.append("f " + " ".join("%d//%d" % (a[i], n[i]) for i in range(3)))
            else:
                t = uv_of[f] + 1
                out.append("f " + " ".join("%d/%d/%d" % (a[i], t[i], n[i]) for i in range(3)))
    with open(path, "w", newline="\n") as f:
        f.write("\n".join(out) + "\n")


def write_mtl(path, materials):
    """materials: list of (name, dict of MTL statement -> value)."""
    out = []
    for name, facts in materials:
        out.append("newmtl " + name)
        out += ["%s %s" % kv for kv in facts.items()]
        out.append("")
    with open(path, "w", newline="\n") as f:
        f.write("\n".join(out))


def write_png(path, rgb):
    """Writes an 8-bit RGB image.  Each row uses the PNG filter with the smallest sum of absolute differences."""
    h, w, _ = rgb.shape
    x = rgb.astype(np.int32)
    left = np.zeros_like(x)
    left[:, 1:] = x[:, :-1]
    up = np.zeros_like(x)
    up[1:] = x[:-1]
    corner = np.zeros_like(x)
    corner[1:, 1:] = x[:-1, :-1]
    pa, pb, pc = np.abs(up - corner), np.abs(left - corner), np.abs(left + up - 2 * corner)
    paeth = np.where((pa <= pb) & (pa <= pc), left, np.where(pb <= pc, up, corner))
    # The five filters of PNG: none, sub, up, average, Paeth.
    kinds = [(x - y) & 255 for y in (0 * x, left, up, (left + up) // 2, paeth)]
    cost = np.array([np.where(k > 127, 256 - k, k).sum((1, 2)) for k in kinds])
    best = cost.argmin(0)
    raw = bytearray()
    for r in range(h):
        raw.append(int(best[r]))
        raw += kinds[best[r]][r].astype(np.uint8).tobytes()

    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data
                + struct.pack(">I", zlib.crc32(kind + data)))
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n"
                + chunk(b"IHDR", struct.pack(">IIBBBBB", w, h, 8, 2, 0, 0, 0))
                + chunk(b"IDAT", zlib.compress(bytes(raw), 9)) + chunk(b"IEND", b""))
