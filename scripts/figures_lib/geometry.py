"""Functions on triangle meshes and plane polygons that figures need."""

import math

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersCore import vtkCleanPolyData, vtkTriangleFilter
from vtkmodules.vtkIOGeometry import vtkOBJReader
from vtkmodules.vtkIOPLY import vtkPLYReader


def read_mesh(path):
    """Returns points and triangles of an OBJ or PLY file. Points at equal positions, as along texture seams, are merged."""
    reader = vtkOBJReader() if path.suffix == ".obj" else vtkPLYReader()
    triangulated, merged = vtkTriangleFilter(), vtkCleanPolyData()
    reader.SetFileName(str(path))
    triangulated.SetInputConnection(reader.GetOutputPort())
    merged.SetInputConnection(triangulated.GetOutputPort())
    merged.SetTolerance(0)
    merged.Update()
    mesh = merged.GetOutput()
    if mesh.GetNumberOfPolys() == 0:
        raise ValueError(f"{path}: no triangles")
    points = vtk_to_numpy(mesh.GetPoints().GetData()).astype(float)
    return points, vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3).astype(int)


def volume(points, triangles):
    """Returns the volume of a closed mesh that faces outward."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def components(points, triangles):
    """Counts connected components. Each triangle passes the least label of its corners to all of them, until nothing changes."""
    labels = np.arange(len(points))
    while True:
        least = labels[triangles].min(axis=1)
        new_labels = labels.copy()
        for k in range(3):
            np.minimum.at(new_labels, triangles[:, k], least)
        new_labels = new_labels[new_labels]
        if (new_labels == labels).all():
            return len(np.unique(labels[np.unique(triangles)]))
        labels = new_labels


def crossed_cells(points, triangles):
    """Returns the cells (integer triples) that a marching cubes surface with vertices at edge midpoints crosses, and their size.

    The centroid of a triangle lies inside the triangle's cell. Coordinates along an axis differ by multiples of half a cell: a
    vertex lies half way between two grid planes along its own edge, and on a grid plane along the two other axes. So the more
    frequent parity of these multiples is that of the grid planes.
    """
    cells = np.empty((len(triangles), 3), int)
    coordinates = np.unique(np.round(points[:, 0], 5))
    steps = np.diff(coordinates)
    half = np.median(steps[steps > 0.2 * np.median(steps)])
    for k in range(3):
        index = np.round((points[:, k] - points[0, k]) / half).astype(int)
        parity = np.bincount(index % 2, minlength=2).argmax()
        cells[:, k] = np.floor((index[triangles].mean(axis=1) - parity) / 2)
    return np.unique(cells, axis=0), 2 * half


def slice_at(points, triangles, z):
    """Returns the segments (n, 2, 2) in which the plane at z cuts the mesh."""
    corners = points[triangles]
    above = corners[:, :, 2] > z
    segments = []
    for corner, side in zip(corners, above):
        if side.all() or not side.any():
            continue
        ends = []
        for k in range(3):
            p, q = corner[k], corner[(k + 1) % 3]
            if side[k] != side[(k + 1) % 3]:
                ends.append((p + (z - p[2]) / (q[2] - p[2]) * (q - p))[:2])
        segments.append(ends)
    return np.array(segments)


def icosphere(subdivisions):
    """Returns points and triangles of a unit icosahedron whose faces are divided into four, several times."""
    g = (1 + math.sqrt(5)) / 2
    points = [np.array(p, float) for a in (-1, 1) for b in (-g, g) for p in ((0, a, b), (b, 0, a), (a, b, 0))]
    points = [p / np.linalg.norm(p) for p in points]
    # Edges of a unit icosahedron are 1.05 long, other distances of vertices at least 1.7.
    near = [[np.linalg.norm(p - q) < 1.1 for q in points] for p in points]
    triangles = []
    for i in range(12):
        for j in range(i + 1, 12):
            for k in range(j + 1, 12):
                if near[i][j] and near[j][k] and near[i][k]:
                    is_outward = np.linalg.det([points[i], points[j], points[k]]) > 0
                    triangles.append((i, j, k) if is_outward else (i, k, j))
    for _ in range(subdivisions):
        middles, finer = {}, []

        def middle(i, j):
            key = (min(i, j), max(i, j))
            if key not in middles:
                middles[key] = len(points)
                points.append((points[i] + points[j]) / np.linalg.norm(points[i] + points[j]))
            return middles[key]

        for a, b, c in triangles:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = finer
    return np.array(points), np.array(triangles)


def prism_obj(outline, depth):
    """Returns the OBJ text of a prism of the counter-clockwise outline, from z = -depth / 2 to depth / 2."""
    n = len(outline)
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for z in (depth / 2, -depth / 2) for x, y in outline]
    lines.append("f " + " ".join(str(i + 1) for i in range(n)))
    lines.append("f " + " ".join(str(n + i + 1) for i in reversed(range(n))))
    for i in range(n):
        j = (i + 1) % n
        lines.append(f"f {i + 1} {n + i + 1} {n + j + 1} {j + 1}")
    return "\n".join(lines) + "\n"


def sample_outline(outline, count):
    """Returns `count` points at even distances along the closed outline."""
    outline = np.asarray(outline, float)
    ends = np.roll(outline, -1, axis=0)
    lengths = np.linalg.norm(ends - outline, axis=1)
    starts = np.concatenate([[0], np.cumsum(lengths)])
    out = []
    for distance in (np.arange(count) + 0.5) * starts[-1] / count:
        i = min(np.searchsorted(starts, distance, side="right") - 1, len(outline) - 1)
        out.append(outline[i] + (distance - starts[i]) / lengths[i] * (ends[i] - outline[i]))
    return np.array(out)


def inside(outline, points):
    """Returns whether each point is inside, by the parity of the crossings of a ray to the right."""
    outline, points = np.asarray(outline, float), np.atleast_2d(points)
    ends = np.roll(outline, -1, axis=0)
    odd = np.zeros(len(points), bool)
    for (x0, y0), (x1, y1) in zip(outline, ends):
        crosses = (y0 > points[:, 1]) != (y1 > points[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing_x = x0 + (points[:, 1] - y0) / (y1 - y0) * (x1 - x0)
        odd ^= crosses & (points[:, 0] < crossing_x)
    return odd


def polygon_area(outline):
    """Returns the area, positive if the outline is counter-clockwise."""
    x, y = np.asarray(outline, float).T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2


def marching_squares(values, x, y, level, midpoint):
    """Returns the segments of values[j, i] = level over points (x[i], y[j]). Ambiguous squares separate the inside corners."""
    segments = []
    for j in range(len(y) - 1):
        for i in range(len(x) - 1):
            corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            v = [values[b, a] - level for a, b in corners]

            def cut(k):
                (a, b), (c, d) = corners[k], corners[(k + 1) % 4]
                t = 0.5 if midpoint else v[k] / (v[k] - v[(k + 1) % 4])
                return (x[a] + t * (x[c] - x[a]), y[b] + t * (y[d] - y[b]))

            # A segment cuts off each run of inside corners, from the edge before it to the edge after it.
            for k in range(4):
                if v[k] > 0 and v[k - 1] <= 0:
                    last = k
                    while v[(last + 1) % 4] > 0:
                        last = (last + 1) % 4
                    segments.append((cut(last), cut((k - 1) % 4)))
    return segments


def enclosed(segments):
    """Returns the area to the left of closed directed segments."""
    return sum(p[0] * q[1] - p[1] * q[0] for p, q in segments) / 2
