"""The Utah teapot as four closed shells.

Newell's patches are open: the lid hovers over the rim, walls have no
thickness, spout and handle end inside the body.  Here the body is solid with
a ledge under the lid, the lid has a flat underside that reaches through the
ledge, the spout's mouth is a recess and every end inside the body is capped.
"""
import numpy as np
from . import topology
from .model import Model, material
from .teapot_data import PATCHES, POINTS

AROUND = 16        # cells along a quarter of the circumference


def bernstein(t):
    s = 1 - t
    return np.stack([s ** 3, 3 * s * s * t, 3 * s * t * t, t ** 3], 1)


def patch(k, rows, cols):
    """Returns a grid of points of patch k.  rows: number of cells, or the values, of the first parameter."""
    c = np.array(POINTS)[list(PATCHES[k])].reshape(4, 4, 3)
    a = bernstein(np.linspace(0, 1, rows + 1) if np.isscalar(rows) else np.asarray(rows))
    b = bernstein(np.linspace(0, 1, cols + 1))
    return np.einsum("ri,cj,ijk->rck", a, b, c)


def ring(ks, row, cols):
    """Returns a closed ring of points (the first is repeated) of patches ks at first parameter `row`."""
    parts = [patch(k, [row], cols)[0] for k in ks]
    return np.concatenate([p[:-1] for p in parts] + [parts[0][:1]])


def scaled(r, s, move=(0, 0, 0)):
    """Returns a ring scaled about its centre, then moved."""
    mid = r[:-1].mean(0)
    return mid + (r - mid) * s + np.asarray(move)


def cap(r, steps, centre=None):
    """Returns a grid from a ring to its centre, in `steps` rows."""
    mid = r[:-1].mean(0) if centre is None else np.asarray(centre, float)
    return np.stack([mid + (r - mid) * (1 - k / steps) for k in range(steps + 1)])


def stitch(grids):
    """Merges grids of points into one closed shell that faces outward."""
    pts, faces, base = [], [], 0
    for g in grids:
        m, n, _ = g.shape
        ids = base + np.arange(m * n).reshape(m, n)
        pts.append(g.reshape(-1, 3))
        base += m * n
        for i in range(m - 1):
            for j in range(n - 1):
                a, b, c, d = ids[i, j], ids[i + 1, j], ids[i + 1, j + 1], ids[i, j + 1]
                p, q, r, s = g[i, j], g[i + 1, j], g[i + 1, j + 1], g[i, j + 1]
                if ((p - r) ** 2).sum() <= ((q - s) ** 2).sum() + 1e-9:
                    faces += [(a, b, c), (a, c, d)]
                else:
                    faces += [(a, b, d), (b, c, d)]
    v = np.concatenate(pts)
    # The offset avoids rounding ties, where nearly equal points would become different ones.
    _, first, inv = np.unique(np.round(v * 1e5 + 0.2371), axis=0, return_index=True, return_inverse=True)
    f = inv.reshape(-1)[np.array(faces)]
    f = f[(f[:, 0] != f[:, 1]) & (f[:, 1] != f[:, 2]) & (f[:, 2] != f[:, 0])]
    return np.round(v[first], 6), orient(f, v[first])


def orient(faces, v):
    """Flips faces so that neighbours are oriented alike and the volume is positive."""
    at = {}
    for i, f in enumerate(faces.tolist()):
        for k in range(3):
            at.setdefault(frozenset((f[k], f[(k + 1) % 3])), []).append(i)
    tri = faces.tolist()
    seen, stack = {0}, [0]
    while stack:
        i = stack.pop()
        for k in range(3):
            a, b = tri[i][k], tri[i][(k + 1) % 3]
            for j in at[frozenset((a, b))]:
                if j in seen:
                    continue
                t = tri[j]
                if (t.index(a) + 1) % 3 == t.index(b):
                    tri[j] = t[::-1]
                seen.add(j)
                stack.append(j)
    out = np.array(tri)
    return out if topology.volume(v, out) > 0 else out[:, ::-1]


def body():
    rim, upper, lower, bottom = range(0, 4), range(4, 8), range(8, 12), range(28, 32)
    grids = [patch(k, 6, AROUND) for k in rim] + [patch(k, 9, AROUND) for k in upper]
    grids += [patch(k, 8, AROUND) for k in lower] + [patch(k, 6, AROUND) for k in bottom]
    inner = ring(rim, 0, AROUND)
    ledge = inner * [0.975, 0.975, 1] - [0, 0, 0.05]
    grids += [np.stack([inner, ledge]), cap(ledge, 6)]
    return stitch(grids)


def lid():
    grids = [patch(k, 8, AROUND) for k in range(20, 24)] + [patch(k, 9, AROUND) for k in range(24, 28)]
    edge = ring(range(24, 28), 1, AROUND)
    under = edge * [0.985, 0.985, 1] - [0, 0, 0.075]
    grids += [np.stack([edge, under]), cap(under, 6)]
    return stitch(grids)


def spout():
    n = 12
    grids = [patch(k, 16, n) for k in (16, 17)] + [patch(k, 5, n) for k in (18, 19)]
    root, lip = ring((16, 17), 0, n), ring((18, 19), 1, n)
    throat = [lip] + [scaled(ring((16, 17), 1 - 0.05 * k, n), 0.66 - 0.02 * k) for k in (1, 2, 3, 4)]
    grids += [cap(root, 3), np.stack(throat), cap(throat[-1], 2)]
    return stitch(grids)


def handle():
    n = 10
    # The lower end as published only touches the wall, so its patches are
    # extrapolated to parameter 1.05; both ends then continue straight inside.
    end_parameter = 1.05
    grids = [patch(k, 14, n) for k in (12, 13)]
    grids += [patch(k, np.linspace(0, end_parameter, 16), n) for k in (14, 15)]
    for r, offset in ((ring((12, 13), 0, n), (0.12, 0, 0)), (ring((14, 15), end_parameter, n), (0.13, 0, 0.02))):
        end = scaled(r, 0.92, offset)
        grids += [np.stack([r, end]), cap(end, 2)]
    return stitch(grids)


def build():
    m = Model("teapot", "the Utah teapot (Newell 1975), closed",
              "32 Bezier patches cut into cells, four shells each with its caps")
    vs, fs, base = [], [], 0
    for name, (v, f) in (("body", body()), ("lid", lid()), ("spout", spout()), ("handle", handle())):
        first = sum(len(x) for x in fs)
        m.groups.append((name, "glaze", np.arange(first, first + len(f))))
        vs.append(v)
        fs.append(f + base)
        base += len(v)
    v = np.concatenate(vs)
    m.v = np.stack([v[:, 0], v[:, 2], -v[:, 1]], 1)      # z up -> y up
    m.faces = np.concatenate(fs)
    m.place_on_ground(size=2.4)
    m.hard_normals(44)
    m.materials = [("glaze", material((0.87, 0.80, 0.68), 0.55, 140))]
    return [m]
