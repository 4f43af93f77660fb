"""Checks of closed meshes, and normals of meshes made by hand."""
import numpy as np


def directed_edges(faces):
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def shells(nverts, faces):
    """Returns for every face the number of its connected component."""
    lab = np.arange(nverts)
    e = directed_edges(faces)
    while True:
        new = lab.copy()
        np.minimum.at(new, e[:, 0], lab[e[:, 1]])
        np.minimum.at(new, e[:, 1], lab[e[:, 0]])
        new = new[new]
        if (new == lab).all():
            break
        lab = new
    _, comp = np.unique(lab[faces[:, 0]], return_inverse=True)
    return comp


def volume(v, faces):
    a, b, c = v[faces[:, 0]], v[faces[:, 1]], v[faces[:, 2]]
    return float((a * np.cross(b, c)).sum() / 6)


def check(v, faces):
    """Returns counts and measures of a mesh; raises AssertionError if it is not closed, consistently oriented and clean."""
    n = len(v)
    assert faces.min() >= 0 and faces.max() < n
    e = directed_edges(faces).astype(np.int64)
    key = e[:, 0] * n + e[:, 1]
    back = e[:, 1] * n + e[:, 0]
    uniq = np.unique(key)
    assert len(uniq) == len(key), "an edge is used twice in one direction"
    assert (np.sort(back) == uniq).all(), "an edge lacks its opposite"
    s = np.sort(faces, axis=1)
    assert len(np.unique(s, axis=0)) == len(s), "duplicate face"
    a, b, c = v[faces[:, 0]], v[faces[:, 1]], v[faces[:, 2]]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    assert area.min() > 1e-8, "degenerate face, area %g" % area.min()
    assert len(np.unique(v, axis=0)) == n, "two vertices in one place"
    # The faces around a vertex must form one fan: a walk across their shared
    # edges must return to the start after it has met all of them.
    nxt = dict()
    for f in faces.tolist():
        for i in range(3):
            nxt[(f[i], f[(i + 1) % 3])] = f[(i + 2) % 3]
    degree = np.bincount(faces.ravel(), minlength=n)
    assert degree.min() > 0, "a vertex without faces"
    first = {f[0]: f[1] for f in faces.tolist()}
    first.update({f[1]: f[2] for f in faces.tolist()})
    first.update({f[2]: f[0] for f in faces.tolist()})
    for p, q in first.items():
        at, count = nxt[(p, q)], 1
        while at != q:
            at, count = nxt[(p, at)], count + 1
        assert count == degree[p], "the faces at a vertex are not one fan"
    comp = shells(n, faces)
    genus = []
    for i in range(comp.max() + 1):
        f = faces[comp == i]
        nv = len(np.unique(f))
        genus.append((2 - (nv - len(f) * 3 // 2 + len(f))) // 2)
        assert volume(v, f) > 0, "a shell faces inward"
    return {"vertices": n, "triangles": len(faces), "shells": int(comp.max()) + 1,
            "genus": genus, "volume": volume(v, faces),
            "area": float(area.sum())}


def corner_normals(v, faces, crease_deg=180.0):
    """Returns (normals, indices per corner): the angle-weighted mean of the
    faces at the vertex whose normals differ by less than the crease angle."""
    p = v[faces]
    fn = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    fn /= np.linalg.norm(fn, axis=1)[:, None]
    ang = np.empty(faces.shape)
    for i in range(3):
        a = p[:, (i + 1) % 3] - p[:, i]
        b = p[:, (i + 2) % 3] - p[:, i]
        ang[:, i] = np.arccos(np.clip((a * b).sum(1) / np.linalg.norm(a, axis=1)
                                      / np.linalg.norm(b, axis=1), -1, 1))
    around = [[] for _ in range(len(v))]
    for f, face in enumerate(faces.tolist()):
        for i in range(3):
            around[face[i]].append((f, i))
    limit = np.cos(np.radians(crease_deg))
    out = np.empty(faces.shape + (3,))
    for ring in around:
        ids = np.array([f for f, _ in ring])
        w = np.array([ang[f, i] for f, i in ring])
        near = fn[ids] @ fn[ids].T >= limit - 1e-9
        s = (near * w) @ fn[ids]
        s /= np.linalg.norm(s, axis=1)[:, None]
        for (f, i), m in zip(ring, s):
            out[f, i] = m
    flat = np.round(out.reshape(-1, 3), 4) + 0.0
    uniq, inv = np.unique(flat, axis=0, return_inverse=True)
    return uniq, inv.reshape(faces.shape)
