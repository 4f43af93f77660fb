"""Texture charts by projection, and textures baked from a colour function of 3D positions.

A chart is a connected patch of one part that faces one of six directions.
The paint is a function of position in space, so both sides of a chart's edge
get the same colour and no seam shows.
"""
import numpy as np

AXES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
# Directions of u and v for each axis, chosen so that no chart is mirrored.
UDIR = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0]], float)
VDIR = np.array([[0, 1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1], [0, 1, 0], [0, 1, 0]], float)


def neighbours(faces):
    """Returns (m, 3): the index of the face across each edge."""
    owner = {}
    for i, f in enumerate(faces.tolist()):
        for k in range(3):
            owner[(f[k], f[(k + 1) % 3])] = i
    return np.array([[owner[(f[(k + 1) % 3], f[k])] for k in range(3)] for f in faces.tolist()])


def components(key, nb):
    """Returns the number of each face's connected set of faces with equal keys; sets are numbered by their first face."""
    comp = np.full(len(key), -1)
    keys, nbl = key.tolist(), nb.tolist()
    count = 0
    for seed in range(len(keys)):
        if comp[seed] >= 0:
            continue
        stack = [seed]
        comp[seed] = count
        while stack:
            f = stack.pop()
            for g in nbl[f]:
                if comp[g] < 0 and keys[g] == keys[f]:
                    comp[g] = count
                    stack.append(g)
        count += 1
    return comp


def facing(v, faces):
    """Returns the unit normals of the faces."""
    p = v[faces]
    n = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    return n / np.linalg.norm(n, axis=1)[:, None]


def overlapping(uv, faces_uv, comp, cell):
    """Returns pairs (lower index, higher index) of faces of one chart that
    cover the same point of a grid with spacing `cell`."""
    pairs = set()
    order = np.argsort(comp, kind="stable")
    for ids in np.split(order, np.nonzero(np.diff(comp[order]))[0] + 1):
        seen = {}
        for f in ids.tolist():
            t = faces_uv[f]
            lo = np.ceil(t.min(0) / cell).astype(int)
            hi = np.floor(t.max(0) / cell).astype(int)
            if (hi < lo).any():
                continue
            gx, gy = np.meshgrid(np.arange(lo[0], hi[0] + 1), np.arange(lo[1], hi[1] + 1))
            q = np.stack([gx.ravel(), gy.ravel()], 1) * cell
            inside = np.ones(len(q), bool)
            for k in range(3):
                a, b = t[k], t[(k + 1) % 3]
                e = b - a
                inside &= e[0] * (q[:, 1] - a[1]) - e[1] * (q[:, 0] - a[0]) > 1e-9
            for x, y in zip(gx.ravel()[inside].tolist(), gy.ravel()[inside].tolist()):
                if (x, y) in seen:
                    pairs.add((seen[(x, y)], f))
                else:
                    seen[(x, y)] = f
    return sorted(pairs)


def cut_charts(v, faces, normals, label):
    """Returns chart and axis of every face, and the number of overlaps that are left (0: success)."""
    # 1. Each face gets the axis that is nearest to its normal; borders are smoothed by votes.
    nb = neighbours(faces)
    face_normals = facing(v, faces)
    mean_normals = normals[faces].mean(1) + face_normals
    score = mean_normals @ AXES.T
    axis = score.argmax(1)
    for _ in range(4):
        for a in range(6):
            votes = ((axis[nb] == a) & (label[nb] == label[:, None])).sum(1)
            axis = np.where((votes >= 2) & (axis != a) & (face_normals @ AXES[a] > 0.4), a, axis)
    # 2. A chart is a connected set of faces with equal part, axis and layer. Faces that cover others
    # move to the next layer, until no chart overlaps itself.
    layer = np.zeros(len(faces), int)
    for round_number in range(16):
        comp = components((layer * 64 + label) * 8 + axis, nb)
        # In the first round, charts below 14 faces join the neighbouring chart that they share most edges with.
        sizes = np.bincount(comp)
        for c in np.nonzero(sizes < (14 if round_number == 0 else 0))[0]:
            ids = np.nonzero(comp == c)[0]
            out = [(axis[g], label[g], layer[g]) for f in ids for g in nb[f] if comp[g] != c]
            for a, l, s in sorted(set(out), key=lambda o: (-out.count(o), o)):
                if (face_normals[ids] @ AXES[a] > 0.22).all():
                    axis[ids], label[ids], layer[ids] = a, l, s
                    break
        comp = components((layer * 64 + label) * 8 + axis, nb)
        corner = np.stack([(v[faces] * UDIR[axis][:, None]).sum(2),
                           (v[faces] * VDIR[axis][:, None]).sum(2)], 2)
        clash = overlapping(None, corner, comp, 0.004)
        if not clash:
            break
        # Of two overlapping faces, the lower one moves.
        depth = (v[faces].mean(1) * AXES[axis]).sum(1)
        low = np.array([f if depth[f] < depth[g] else g for f, g in clash])
        layer[np.unique(low)] += 1
    return comp, axis, len(clash)


class Skyline:
    """Packs rectangles into a square: each at the lowest place, the leftmost of those."""

    def __init__(self, size):
        self.size, self.top = size, np.zeros(size, int)

    def place(self, w, h):
        if w > self.size:
            return None
        win = np.lib.stride_tricks.sliding_window_view(self.top, w).max(1)
        x = int(win.argmin())
        y = int(win[x])
        if y + h > self.size:
            return None
        self.top[x:x + w] = y + h
        return x, y


def pack(extent, size, pad):
    """Returns the largest scale at which all charts fit, their positions, and which are rotated by 90 degrees.

    extent: size of each chart; size, pad: side of the texture and margin around a chart, in texels."""
    is_rotated = extent[:, 0] > extent[:, 1]
    upright = np.where(is_rotated[:, None], extent[:, ::-1], extent)
    order = np.lexsort((np.arange(len(upright)), -upright[:, 0], -upright[:, 1]))

    def attempt(scale):
        px = np.ceil(upright * scale).astype(int) + 2 * pad
        sky, at = Skyline(size), np.zeros((len(upright), 2), int)
        for c in order:
            spot = sky.place(int(px[c, 0]), int(px[c, 1]))
            if spot is None:
                return None
            at[c] = spot
        return at
    # Bisect the scale.
    lo, hi = 1.0, 4.0 * size
    for _ in range(24):
        mid = (lo + hi) / 2
        if attempt(mid) is None:
            hi = mid
        else:
            lo = mid
    return lo, attempt(lo), is_rotated


def unwrap(v, faces, normals, label, size, density, pad=5):
    """Returns texture coordinates: (uv, index per corner, pixel position per corner).

    density[label]: factor on the resolution of a part."""
    comp, axis, clash = cut_charts(v, faces, normals, label.copy())
    assert clash == 0, "charts overlap"
    count = comp.max() + 1
    densities = np.zeros(count)
    np.maximum.at(densities, comp, np.asarray(density, float)[label])
    p = v[faces]
    uv = np.stack([(p * UDIR[axis][:, None]).sum(2), (p * VDIR[axis][:, None]).sum(2)], 2)
    uv *= densities[comp][:, None, None]
    lo = np.full((count, 2), np.inf)
    hi = np.full((count, 2), -np.inf)
    np.minimum.at(lo, comp, uv.min(1))
    np.maximum.at(hi, comp, uv.max(1))
    scale, at, is_rotated = pack(hi - lo, size, pad)
    q = (uv - lo[comp][:, None]) * scale
    # Rotate charts by 90 degrees, without mirroring them.
    width = ((hi - lo)[:, 1] * scale)[comp]
    rotated = np.stack([width[:, None] - q[:, :, 1], q[:, :, 0]], 2)
    q = np.where(is_rotated[comp][:, None, None], rotated, q) + at[comp][:, None] + pad
    tex = np.stack([q[:, :, 0] / size, q[:, :, 1] / size], 2).reshape(-1, 2)
    tex = np.round(tex, 5)
    key = np.concatenate([tex, faces.reshape(-1, 1)], 1)
    _, first, inv = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return tex[first], inv.reshape(faces.shape), tex.reshape(-1, 3, 2) * size


def bake(v, faces, corner, size, paint, over=2, margin=4):
    """Returns the texture.  Each texel within `margin` texels of a chart is the mean
    of over x over samples, painted from the nearest triangle's plane; others
    get blurred colours, which matter for mipmaps."""
    n = size * over
    best = np.full((n, n), np.inf)
    point = np.zeros((n, n, 3), np.float32)
    max_distance = margin * over
    for f in range(len(faces)):
        t = corner[f] * over
        p = v[faces[f]]
        x0, y0 = np.maximum(np.floor(t.min(0)).astype(int) - max_distance, 0)
        x1, y1 = np.minimum(np.ceil(t.max(0)).astype(int) + max_distance, n)
        gx, gy = np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5)
        e1, e2 = t[1] - t[0], t[2] - t[0]
        det = e1[0] * e2[1] - e1[1] * e2[0]
        if abs(det) < 1e-9:
            continue
        # Barycentric coordinates of the samples, and their distances from the triangle.
        qx, qy = gx - t[0, 0], gy - t[0, 1]
        b1 = (qx * e2[1] - qy * e2[0]) / det
        b2 = (qy * e1[0] - qx * e1[1]) / det
        distance = np.zeros_like(b1)
        for b, (i, j) in ((1 - b1 - b2, (1, 2)), (b1, (2, 0)), (b2, (0, 1))):
            height = abs(det) / max(np.hypot(*(t[j] - t[i])), 1e-9)
            distance = np.maximum(distance, -b * height)
        win = best[y0:y1, x0:x1]
        is_nearer = (distance < win) & (distance < max_distance)
        win[is_nearer] = distance[is_nearer]
        q = p[0] + b1[is_nearer][:, None] * (p[1] - p[0]) + b2[is_nearer][:, None] * (p[2] - p[0])
        point[y0:y1, x0:x1][is_nearer] = q
    hit = np.isfinite(best)
    rgb = np.zeros((n, n, 3), np.float32)
    hit_indices = np.nonzero(hit.ravel())[0]
    flat, src = rgb.reshape(-1, 3), point.reshape(-1, 3)
    for chunk in np.array_split(hit_indices, max(1, len(hit_indices) // 200000)):
        flat[chunk] = np.clip(paint(src[chunk].astype(float)), 0, 1)
    sample_count = hit.reshape(size, over, size, over).sum((1, 3)).astype(float)
    img = rgb.reshape(size, over, size, over, 3).sum((1, 3)) / np.maximum(sample_count, 1)[:, :, None]
    return (np.clip(fill(img, sample_count > 0), 0, 1) * 255 + 0.5).astype(np.uint8)[::-1]


def fill(img, known):
    """Fills unknown texels from averages of known ones, at ever coarser resolutions."""
    if known.all() or min(known.shape) < 2:
        return img
    h, w = known.shape[0] // 2, known.shape[1] // 2
    k = known.reshape(h, 2, w, 2)
    cnt = k.sum((1, 3))
    small = (img * known[:, :, None]).reshape(h, 2, w, 2, 3).sum((1, 3)) / np.maximum(cnt, 1)[:, :, None]
    small = fill(small, cnt > 0)
    big = np.repeat(np.repeat(small, 2, 0), 2, 1)
    return np.where(known[:, :, None], img, big)
