"""Sphere, torus, cube and puddle."""
import numpy as np
from .model import Model, material


def grid_faces(ids):
    """Returns two triangles per cell of a grid of vertex indices; diagonals
    alternate, so that no direction is preferred."""
    out = []
    for i in range(ids.shape[0] - 1):
        for j in range(ids.shape[1] - 1):
            a, b, c, d = ids[i, j], ids[i + 1, j], ids[i + 1, j + 1], ids[i, j + 1]
            out += [(a, b, c), (a, c, d)] if (i + j) % 2 == 0 else [(a, b, d), (b, c, d)]
    return out


def finish(m, group, colour, ks=0.35, ns=60):
    """Gives a model one group and one material."""
    m.groups = [(group, m.name, np.arange(len(m.faces)))]
    m.materials = [(m.name, material(colour, ks, ns))]
    return m


def sphere(level=4):
    """Icosahedron whose edges are halved `level` times, with all vertices on the sphere."""
    g = (1 + 5 ** 0.5) / 2
    v = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
         (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    v = [np.array(p) / np.linalg.norm(p) for p in v]
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
         (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8),
         (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(level):
        mids, out = {}, []

        def mid(a, b):
            k = (min(a, b), max(a, b))
            if k not in mids:
                p = v[a] + v[b]
                mids[k] = len(v)
                v.append(p / np.linalg.norm(p))
            return mids[k]
        for a, b, c in f:
            ab, bc, ca = mid(a, b), mid(b, c), mid(c, a)
            out += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        f = out
    m = Model("sphere", "ball of radius 1", "icosahedron, its faces halved four times")
    m.v, m.faces = np.array(v), np.array(f)
    m.normals, m.normal_of = np.round(m.v, 4) + 0.0, m.faces
    m.place_on_ground()
    return finish(m, "sphere", (0.80, 0.34, 0.26))


def torus(R=0.9, r=0.36, nu=76, nv=32):
    """Torus about y with nu x nv vertices."""
    u = np.arange(nu) * 2 * np.pi / nu
    w = np.arange(nv) * 2 * np.pi / nv
    U, W = np.meshgrid(u, w, indexing="ij")
    n = np.stack([np.cos(W) * np.cos(U), np.sin(W), -np.cos(W) * np.sin(U)], 2)
    c = np.stack([np.cos(U), 0 * U, -np.sin(U)], 2) * R
    ids = np.arange(nu * nv).reshape(nu, nv)
    ids = np.pad(ids, ((0, 1), (0, 1)), mode="wrap")
    m = Model("torus", "ring lying flat; genus 1", "circle of radius 0.36 swept round one of radius 0.9")
    m.v = (c + r * n).reshape(-1, 3)
    m.faces = np.array(grid_faces(ids))
    m.normals, m.normal_of = np.round(n.reshape(-1, 3), 4) + 0.0, m.faces
    m.genus = 1
    m.place_on_ground()
    return finish(m, "torus", (0.86, 0.60, 0.20))


def cube(n=16, size=1.6):
    """Cube with sharp edges: faces share positions there, but not normals."""
    index, v, faces = {}, [], []

    def vertex(p):
        if p not in index:
            index[p] = len(v)
            v.append(p)
        return index[p]
    for axis in range(3):
        for side in (0, n):
            ids = np.empty((n + 1, n + 1), int)
            for i in range(n + 1):
                for j in range(n + 1):
                    p = [0, 0, 0]
                    p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = side, i, j
                    ids[i, j] = vertex(tuple(p))
            faces += grid_faces(ids if side else ids.T)
    m = Model("cube", "cube with sharp edges", "six grids of 16 x 16 cells")
    m.v, m.faces = np.array(v) * (size / n), np.array(faces)
    m.place_on_ground()
    m.hard_normals(30)
    return finish(m, "cube", (0.24, 0.52, 0.62), 0.25, 40)


def disc_rings(rings):
    """Returns a disc of radius 1: points (ring k has 6 k), triangles, and indices of the outer ring."""
    p, start, faces = [(0.0, 0.0)], [0], []
    for k in range(1, rings + 1):
        start.append(len(p))
        a = np.arange(6 * k) * np.pi / (3 * k)
        p += [(k / rings * np.cos(t), k / rings * np.sin(t)) for t in a]
    for k in range(1, rings + 1):
        inner = max(6 * (k - 1), 1)
        for s in range(6):
            for j in range(k):
                o0 = start[k] + s * k + j
                o1 = start[k] + (s * k + j + 1) % (6 * k)
                i0 = start[k - 1] + (s * (k - 1) + j) % inner
                faces.append((i0, o0, o1))
                if j < k - 1:
                    i1 = start[k - 1] + (s * (k - 1) + j + 1) % inner
                    faces.append((i0, o1, i1))
    return np.array(p), faces, list(range(start[rings], len(p)))


def puddle(radius=1.0, height=0.16, rings=16, rim=8):
    """Flat drop: two discs, joined by half a torus of rim + 1 rows of points."""
    disc, tri, edge = disc_rings(rings)
    flat = radius - height / 2
    n = len(disc)
    top = np.stack([disc[:, 0] * flat, np.full(n, height / 2), -disc[:, 1] * flat], 1)
    v = [top, top * [1, -1, 1]]
    faces = [tri, [(a + n, c + n, b + n) for a, b, c in tri]]
    rows = [np.array(edge)]
    d = disc[edge]
    at = 2 * n
    for k in range(1, rim):
        t = np.pi / 2 - np.pi * k / rim
        r = flat + height / 2 * np.cos(t)
        v.append(np.stack([d[:, 0] * r, np.full(len(d), height / 2 * np.sin(t)), -d[:, 1] * r], 1))
        rows.append(np.arange(at, at + len(d)))
        at += len(d)
    rows.append(np.array(edge) + n)
    ids = np.array(rows)
    faces.append(grid_faces(np.concatenate([ids, ids[:, :1]], 1)))
    m = Model("puddle", "flat drop with a rounded rim", "two discs joined by half a torus")
    m.v, m.faces = np.concatenate(v), np.concatenate([np.array(f) for f in faces])
    m.place_on_ground()
    m.hard_normals(60)
    return finish(m, "puddle", (0.22, 0.45, 0.78), 0.6, 120)


def build():
    return [cube(), puddle(), sphere(), torus()]
