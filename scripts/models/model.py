"""A model with its files, and the steps from a distance field to a model."""
import os
import numpy as np
from . import charts, files, polygonise, topology


class Model:
    def __init__(self, name, about, how):
        self.name, self.about, self.how = name, about, how
        self.v = self.faces = self.uv = self.uv_of = self.image = None
        self.normals = self.normal_of = None
        self.groups, self.materials = [], []
        self.genus = 0          # of every shell; checked by write()

    def place_on_ground(self, scale=None, size=None):
        """Moves the model onto y = 0, centred in x and z.  size: length of its longest side."""
        v = self.v
        if size is not None:
            scale = size / (v.max(0) - v.min(0)).max()
        if scale is not None:
            v = v * scale
        mid = (v.max(0) + v.min(0)) / 2
        mid[1] = v[:, 1].min()
        self.v = np.round(v - mid, 5) + 0.0

    def hard_normals(self, crease_deg):
        """Gives the model normals that differ across edges sharper than the crease angle."""
        self.normals, self.normal_of = topology.corner_normals(self.v, self.faces, crease_deg)

    def write(self, folder):
        """Writes the files; returns counts and measures for SOURCES.md."""
        facts = topology.check(self.v, self.faces)
        assert all(g == self.genus for g in facts["genus"]), "%s: genus %s" % (self.name, facts["genus"])
        stem = os.path.join(folder, self.name)
        title = ["%s - %s" % (self.name, self.about),
                 "Made by scripts/make_models; see SOURCES.md.  SPDX-License-Identifier: Apache-2.0"]
        files.write_obj(stem + ".obj", title, self.name + ".mtl", self.v, self.faces, self.groups,
                        self.normals, self.normal_of, self.uv, self.uv_of)
        files.write_mtl(stem + ".mtl", self.materials)
        if self.image is not None:
            files.write_png(stem + ".png", self.image)
        facts["groups"] = [g for g, _, ids in self.groups if len(ids)]
        facts["extent"] = (self.v.max(0) - self.v.min(0)).tolist()
        return facts


def material(kd, ks=0.05, ns=20, texture=None):
    """Returns the MTL statements of a material: diffuse colour, specular strength and exponent."""
    m = {"Ka": "0 0 0", "Kd": "%g %g %g" % tuple(kd), "Ks": "%g %g %g" % (ks, ks, ks),
         "Ns": "%g" % ns, "illum": "2"}
    if texture:
        m["map_Kd"] = texture
    return m


def majority(label, nb, rounds=3):
    """Smooths borders of parts: a face takes the label that two of its three neighbours have."""
    for _ in range(rounds):
        for a in range(label.max() + 1):
            votes = (label[nb] == a).sum(1)
            label = np.where(votes >= 2, a, label)
    return label


def keep_largest_pieces(label, nb):
    """Keeps the largest connected piece of every part; other pieces get the
    most frequent label of their neighbours."""
    for _ in range(4):
        comp = charts.components(label, nb)
        sizes = np.bincount(comp)
        biggest = {}
        for c in range(len(sizes)):
            part = label[comp == c][0]
            if part not in biggest or sizes[c] > sizes[biggest[part]]:
                biggest[part] = c
        stray = [c for c in range(len(sizes)) if c not in biggest.values()]
        if not stray:
            return label
        for c in stray:
            ids = np.nonzero(comp == c)[0]
            out = [label[g] for f in ids for g in nb[f] if comp[g] != c]
            label[ids] = max(sorted(set(out)), key=out.count)
    return label


def organic(model, field, parts, paint, lo, hi, h, triangles, weight=None, density=None,
            texture=1024, shine=(0.08, 24), flat=0.05):
    """Makes mesh, groups, texture coordinates and texture of a model from a distance field.

    parts(p): list of (name, distance); a face belongs to the nearest part.  Some distances are
    shifted by some thousandths, to move the borders of the parts.  paint(p): colours.
    lo, hi, h: corners of the grid and size of its cells.  weight, flat: see polygonise.
    density: see charts.unwrap().  shine: specular strength and exponent."""
    v, faces, normals = polygonise.build(field, lo, hi, h, triangles, weight, flat)
    nb = charts.neighbours(faces)
    mid = v[faces].mean(1)
    rows = parts(mid)
    names = [n for n, _ in rows]
    label = np.argmin(np.stack([d for _, d in rows]), axis=0)
    label = keep_largest_pieces(majority(label, nb), nb)
    densities = [(density or {}).get(n, 1.0) for n in names]
    model.uv, model.uv_of, corner = charts.unwrap(v, faces, normals, label, texture, densities)
    model.image = charts.bake(v, faces, corner, texture, paint)
    model.v, model.faces = v, faces
    model.place_on_ground()
    model.normals = np.round(normals, 4) + 0.0
    model.normal_of = faces
    model.groups = [(n, model.name, np.nonzero(label == i)[0]) for i, n in enumerate(names)]
    model.materials = [(model.name, material((1, 1, 1), shine[0], shine[1], model.name + ".png"))]
    return model
