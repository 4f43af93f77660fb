"""Makes a closed triangle mesh from a signed distance.

Naive surface nets on a fine grid; then edge collapses, which keep small
triangles where the surface is curved; then smoothing along the surface, with
every vertex projected onto the zero set.
"""
import heapq
import numpy as np
from .implicit import gradient

BLOCK = 8  # grid nodes along a side of the blocks that sample() skips


def sample(field, lo, dims, h):
    """Returns distances at the grid nodes; blocks far from the surface get
    -1000 or 1000 by the sign at their centre."""
    nb = [(d + BLOCK - 1) // BLOCK for d in dims]
    ids = np.stack(np.meshgrid(*[np.arange(n) for n in nb], indexing="ij"), -1).reshape(-1, 3)
    mid = lo + (ids * BLOCK + (BLOCK - 1) / 2) * h
    d = field(mid)
    # Half the diagonal of a block is 0.87 of its side; 1.7 is a margin, as distances are approximate.
    near = np.abs(d) < BLOCK * h * 0.87 * 1.7
    full = np.empty([n * BLOCK for n in nb])
    view = full.reshape(nb[0], BLOCK, nb[1], BLOCK, nb[2], BLOCK).transpose(0, 2, 4, 1, 3, 5)
    flat = np.repeat(np.where(d < 0, -1e3, 1e3), BLOCK ** 3).reshape(len(ids), BLOCK, BLOCK, BLOCK)
    node_offsets = np.stack(np.meshgrid(*[np.arange(BLOCK)] * 3, indexing="ij"), -1).reshape(-1, 3)
    near_blocks = np.nonzero(near)[0]
    for chunk in np.array_split(near_blocks, max(1, len(near_blocks) // 200)):
        p = lo + (ids[chunk][:, None, :] * BLOCK + node_offsets[None]) * h
        flat[chunk] = field(p.reshape(-1, 3)).reshape(-1, BLOCK, BLOCK, BLOCK)
    view[...] = flat.reshape(nb + [BLOCK] * 3)
    return full


def close_crevices(val):
    """Makes the inside well-composed: no two inside nodes, and no two outside
    nodes, are connected only by the diagonal of a grid square or cube.  The net
    would not be a manifold there, so the outside node nearest to the surface
    becomes inside."""
    def corner(a, shift):
        """Returns the values at one corner of all squares or cubes.  shift: 0 or 1 along each axis;
        None along the normal of a square."""
        return a[tuple(slice(None) if s is None else slice(1, None) if s else slice(0, -1) for s in shift)]
    squares = []
    for axis in range(3):
        u, w = (axis + 1) % 3, (axis + 2) % 3
        square = []
        for du, dw in ((0, 0), (1, 0), (1, 1), (0, 1)):
            s = [None] * 3
            s[u], s[w] = du, dw
            square.append(tuple(s))
        squares.append(square)
    eight = [(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]

    def fill(at, corners):
        """Makes the outside corner that is nearest to the surface an inside node, at each place."""
        pts = at[:, None, :] + np.array([[s or 0 for s in c] for c in corners])[None]
        d = val[tuple(np.moveaxis(pts, 2, 0))]
        best = np.where(d < 0, np.inf, d).argmin(1)
        p = pts[np.arange(len(pts)), best]
        val[tuple(p.T)] = -1e-4

    for _ in range(60):
        inside = val < 0
        dirty = 0
        for square in squares:
            a, b, c, d = [corner(inside, s) for s in square]
            at = np.argwhere((a == c) & (b == d) & (a != b))
            if len(at):
                fill(at, square)
                dirty += len(at)
        cs = [corner(inside, s) for s in eight]
        count = np.sum([c.astype(np.int8) for c in cs], axis=0)
        for i in range(4):
            pair = cs[i] & cs[7 - i] & (count == 2) | ~cs[i] & ~cs[7 - i] & (count == 6)
            at = np.argwhere(pair)
            if len(at):
                fill(at, eight)
                dirty += len(at)
        if not dirty:
            return
    raise AssertionError("crevices do not close")


def surface_nets(field, lo, hi, h):
    """Returns vertices and triangles of the surface net in a box.  A cell that the surface crosses
    gets a vertex, the mean of the crossings of its edges; a crossed edge gets a quad of the four
    cells around it."""
    lo = np.asarray(lo, float)
    dims = np.ceil((np.asarray(hi, float) - lo) / h).astype(int) + 1
    val = sample(field, lo, dims, h)
    close_crevices(val)
    shape = np.array(val.shape)
    inside = val < 0
    total = int(shape.prod())
    crossing_sum = np.zeros((total, 3))
    crossing_count = np.zeros(total)
    quads = []
    stride = np.array([shape[1] * shape[2], shape[2], 1])
    for axis in range(3):
        a = [slice(None)] * 3
        b = [slice(None)] * 3
        a[axis], b[axis] = slice(0, -1), slice(1, None)
        crossings = np.argwhere(inside[tuple(a)] != inside[tuple(b)])
        i0 = crossings @ stride
        v0, v1 = val.reshape(-1)[i0], val.reshape(-1)[i0 + stride[axis]]
        p = crossings.astype(float)
        p[:, axis] += np.clip(v0 / (v0 - v1), 0.02, 0.98)
        u, w = (axis + 1) % 3, (axis + 2) % 3
        cells = np.stack([i0 - stride[u] - stride[w], i0 - stride[w], i0, i0 - stride[u]], 1)
        for c in cells.T:
            np.add.at(crossing_sum, c, p)
            np.add.at(crossing_count, c, 1)
        outward = v0 < 0
        quads.append(np.where(outward[:, None], cells, cells[:, ::-1]))
    q = np.concatenate(quads)
    used = np.nonzero(crossing_count)[0]
    index = np.full(total, -1)
    index[used] = np.arange(len(used))
    v = lo + crossing_sum[used] / crossing_count[used][:, None] * h
    q = index[q]
    # Split each quad along its shorter diagonal.
    d02 = ((v[q[:, 0]] - v[q[:, 2]]) ** 2).sum(1)
    d13 = ((v[q[:, 1]] - v[q[:, 3]]) ** 2).sum(1)
    first = (d02 <= d13)[:, None]
    t1 = np.where(first, q[:, [0, 1, 2]], q[:, [1, 2, 3]])
    t2 = np.where(first, q[:, [0, 2, 3]], q[:, [1, 3, 0]])
    return v, np.stack([t1, t2], 1).reshape(-1, 3)


def project(field, v, e, steps=4, limit=None):
    """Moves points onto the zero set by Newton steps along the gradient, each at most `limit` long.

    e: size of a cell; gradients are differences over a tenth of it."""
    limit = e if limit is None else limit
    for _ in range(steps):
        g = gradient(field, v, e * 0.1)
        g2 = np.maximum((g * g).sum(1), 1e-3)
        step = g * (field(v) / g2)[:, None]
        n = np.linalg.norm(step, axis=1)
        v = v - step * np.minimum(1.0, limit / np.maximum(n, 1e-12))[:, None]
    return v


def unit_normals(field, v, e):
    g = gradient(field, v, e)
    return g / np.maximum(np.linalg.norm(g, axis=1), 1e-9)[:, None]


def relax(field, v, faces, e, rounds, amount=0.5):
    """Moves vertices along the surface toward the mean of their neighbours."""
    a = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])  # directed edges
    for _ in range(rounds):
        s = np.zeros_like(v)
        np.add.at(s, a[:, 0], v[a[:, 1]])
        c = np.bincount(a[:, 0], minlength=len(v))
        move = s / c[:, None] - v
        n = unit_normals(field, v, e * 0.5)
        move -= n * (move * n).sum(1)[:, None]
        v = project(field, v + amount * move, e, 2)
    return v


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def decimate(v, faces, normals, target, weight, flat=0.05):
    """Collapses edges, cheapest first, until `target` triangles are left.

    The cost of an edge is l^2 (|n0 - n1|^2 / 64 + flat^2) weight: the square of
    its sagitta (distance of the surface from the edge), plus a term that limits
    triangles of flat areas.  l: its length; n0, n1: normals at its ends.
    """
    pos = [tuple(p) for p in v.tolist()]
    nor = [tuple(p) for p in normals.tolist()]
    wgt = weight.tolist()
    tri = [tuple(f) for f in faces.tolist()]
    around = [set() for _ in pos]
    for i, f in enumerate(tri):
        for c in f:
            around[c].add(i)
    stamp = [0] * len(pos)  # changes of each vertex: a heap entry with other stamps is outdated
    alive = len(tri)

    def ring(i):
        r = set()
        for f in around[i]:
            r.update(tri[f])
        r.discard(i)
        return r

    def edge_cost(i, j):
        d = sub(pos[i], pos[j])
        m = sub(nor[i], nor[j])
        l2 = dot(d, d)
        return l2 * (dot(m, m) / 64 + flat * flat) * max(wgt[i], wgt[j])

    heap = []
    for f in tri:
        for a, b in ((f[0], f[1]), (f[1], f[2]), (f[2], f[0])):
            if a < b:
                heap.append((edge_cost(a, b), a, b, 0, 0))
    heapq.heapify(heap)
    while alive > target and heap:
        _, i, j, si, sj = heapq.heappop(heap)
        if stamp[i] != si or stamp[j] != sj:
            continue
        ri, rj = ring(i), ring(j)
        both = ri & rj
        # The mesh must stay a manifold, and the new vertex have at most 9 neighbours.
        if len(both) != 2 or len(ri) + len(rj) - 4 > 9:
            continue
        if any(len(around[k]) <= 4 for k in both):  # each would keep fewer than 4 faces
            continue
        n = (nor[i][0] + nor[j][0], nor[i][1] + nor[j][1], nor[i][2] + nor[j][2])
        n_length = dot(n, n) ** 0.5
        if n_length < 0.8:  # the normals are more than 133 degrees apart
            continue
        n = (n[0] / n_length, n[1] / n_length, n[2] / n_length)
        d = sub(pos[j], pos[i])
        # The new vertex is the middle of the arc through both ends, not of the chord.
        lift = (dot(d, nor[j]) - dot(d, nor[i])) / 8
        p = tuple((pos[i][k] + pos[j][k]) / 2 + lift * n[k] for k in range(3))
        shared = around[i] & around[j]
        is_valid = True
        for f in (around[i] | around[j]) - shared:
            q = [p if c == i or c == j else pos[c] for c in tri[f]]
            e1, e2 = sub(q[1], q[0]), sub(q[2], q[0])
            c = cross(e1, e2)
            c_length = dot(c, c) ** 0.5
            e3 = sub(q[2], q[1])
            longest = max(dot(e1, e1), dot(e2, e2), dot(e3, e3))
            if c_length < 0.22 * longest:  # a sliver: its height is below 0.22 of its longest edge
                is_valid = False
                break
            for k in tri[f]:
                m = n if k == i or k == j else nor[k]
                if dot(c, m) < 0.35 * c_length:  # the face would turn 70 degrees from a normal
                    is_valid = False
                    break
            if not is_valid:
                break
        if not is_valid:
            continue
        # Remove the two faces at the edge, and move the others from j to i.
        for f in shared:
            for c in tri[f]:
                around[c].discard(f)
            tri[f] = None
            alive -= 1
        for f in around[j]:
            tri[f] = tuple(i if c == j else c for c in tri[f])
            around[i].add(f)
        around[j] = set()
        pos[i], nor[i], wgt[i] = p, n, max(wgt[i], wgt[j])
        stamp[j] += 1
        stamp[i] += 1
        for k in sorted(ring(i)):
            a, b = (i, k) if i < k else (k, i)
            heapq.heappush(heap, (edge_cost(a, b), a, b, stamp[a], stamp[b]))
    keep = sorted({c for f in tri if f for c in f})
    index = {c: k for k, c in enumerate(keep)}
    return (np.array([pos[c] for c in keep]),
            np.array([[index[c] for c in f] for f in tri if f]))


def flip_edges(v, faces, normals, rounds=3):
    """Flips edges whose two opposite angles sum to more than 180 degrees (as for a Delaunay
    triangulation), unless a new face would turn more than 53 degrees from a vertex normal."""
    tri = [list(f) for f in faces.tolist()]
    pos = [tuple(p) for p in v.tolist()]
    nor = [tuple(p) for p in normals.tolist()]
    degree = np.bincount(faces.ravel(), minlength=len(v)).tolist()
    for _ in range(rounds):
        owner = {}
        for i, f in enumerate(tri):
            for k in range(3):
                owner[(f[k], f[(k + 1) % 3])] = i
        dirty, changed = set(), 0
        for (a, b), f in list(owner.items()):
            g = owner.get((b, a))
            if a > b or g is None or f in dirty or g in dirty:
                continue
            c = next(x for x in tri[f] if x != a and x != b)
            d = next(x for x in tri[g] if x != a and x != b)
            if (c, d) in owner or (d, c) in owner or degree[a] <= 4 or degree[b] <= 4:
                continue

            def cot(o, p, q):
                x, y = sub(pos[p], pos[o]), sub(pos[q], pos[o])
                m = cross(x, y)
                return dot(x, y) / max(dot(m, m) ** 0.5, 1e-12)
            if cot(c, a, b) + cot(d, a, b) > -0.05:  # the sum is 0 where the angles sum to 180 degrees
                continue
            is_valid = True
            for t in ((a, d, c), (b, c, d)):
                m = cross(sub(pos[t[1]], pos[t[0]]), sub(pos[t[2]], pos[t[0]]))
                m_length = dot(m, m) ** 0.5
                if m_length < 1e-9 or any(dot(m, nor[k]) < 0.6 * m_length for k in t):
                    is_valid = False
            if not is_valid:
                continue
            tri[f], tri[g] = [a, d, c], [b, c, d]
            owner[(c, d)] = owner[(d, c)] = -1
            dirty.update((f, g))
            degree[a] -= 1
            degree[b] -= 1
            degree[c] += 1
            degree[d] += 1
            changed += 1
        if not changed:
            break
    return np.array(tri)


def build(field, lo, hi, h, target, weight=None, flat=0.05):
    """Returns (vertices, faces, normals) of the zero set, with about `target` faces.

    lo, hi, h: corners of the grid and size of its cells.
    weight(p): factor on the cost of edges at p, for more detail there."""
    v, f = surface_nets(field, lo, hi, h)
    v = project(field, v, h, 3, 0.5 * h)
    v = relax(field, v, f, h, 2)
    n = unit_normals(field, v, h * 0.5)
    w = np.ones(len(v)) if weight is None else weight(v)
    v, f = decimate(v, f, n, target, w, flat)
    v = project(field, v, h, 3, h)
    for _ in range(2):
        f = flip_edges(v, f, unit_normals(field, v, h * 0.5))
        v = relax(field, v, f, h, 1, 0.35)
    v = np.round(project(field, v, h, 3, h), 5) + 0.0
    return v, f, unit_normals(field, v, h * 0.5)
