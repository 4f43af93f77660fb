"""Checks the shape, type and values of input arrays, and makes them contiguous."""
import numpy

from . import _polymorph
from .error import Error


def _array(values, name, shape, kinds, expected):
    """Returns values as an array. Raises Error unless its shape (-1: any size) and its dtype.kind, one of `kinds`, fit."""
    if numpy.ma.is_masked(values):
        raise Error(f"{name}: has masked values - fill them or leave them out", 3)
    try:
        array = numpy.asarray(values)
    except ValueError as error:
        raise Error(f"{name}: not an array ({error})", 3) from None
    if array.dtype.kind not in kinds:
        raise Error(f"{name}: {expected} are needed, not {array.dtype}", 3)
    if array.ndim != len(shape) or any(wanted not in (-1, actual) for wanted, actual in zip(shape, array.shape)):
        text = ", ".join("n" if wanted == -1 else str(wanted) for wanted in shape)
        raise Error(f"{name}: has the shape {array.shape} - it must be ({text}{',' if len(shape) == 1 else ''})", 3)
    return array


def to_reals(values, name, shape):
    """Returns values as a contiguous, finite float32 array of this shape (-1: any size)."""
    array = _array(values, name, shape, "fiu", "real numbers")
    with numpy.errstate(over="ignore"):
        rows = numpy.ascontiguousarray(array, numpy.float32)
    finite = numpy.isfinite(rows)
    if not finite.all():
        index = tuple(int(i) for i in numpy.argwhere(~finite)[0])
        raise Error(f"{name}[{', '.join(map(str, index))}] is {array[index]} - all must be finite, and fit float32", 3)
    return rows


def to_points(values, name, count=-1):
    """Returns values as (count, 3) float32."""
    return to_reals(values, name, (count, 3))


def to_faces(values, vertex_count):
    """Returns values as (m, 3) uint32, each below vertex_count."""
    array = _array(values, "faces", (-1, 3), "iu", "integers")
    wrong = (array < 0) | (array >= vertex_count)
    if wrong.any():
        row, column = (int(i) for i in numpy.argwhere(wrong)[0])
        raise Error(f"faces[{row}, {column}] is {array[row, column]} - there are vertices 0 to {vertex_count - 1}", 3)
    return numpy.ascontiguousarray(array, numpy.uint32).copy()


def to_polygons(values, vertex_count):
    """Returns the corners of all polygons in one row, and each polygon's size, uint32. values: (m, k) integers, or a list."""
    if not hasattr(values, "shape"):
        values = list(values)
        if len({len(row) if hasattr(row, "__len__") else 0 for row in values}) > 1:
            return _ragged_polygons(values, vertex_count)
    array = numpy.asarray(values) if len(values) else numpy.empty((0, 3), int)
    if array.dtype.kind not in "iu":
        raise Error(f"faces: integers are needed, not {array.dtype}", 3)
    if array.ndim != 2 or array.shape[1] < 3:
        raise Error(f"faces: has the shape {array.shape} - it must be (m, 3) or, for polygons of k corners, (m, k)", 3)
    _check_corners(array, "faces", vertex_count)
    return numpy.ascontiguousarray(array, numpy.uint32).reshape(-1), numpy.full(len(array), array.shape[1], numpy.uint32)


def _ragged_polygons(rows, vertex_count):
    """Converts a list of polygons with different numbers of corners, as to_polygons() does."""
    polygons = []
    for i, row in enumerate(rows):
        polygon = _array(row, f"faces[{i}]", (-1,), "iu", "integers")
        if len(polygon) < 3:
            raise Error(f"faces[{i}] has {len(polygon)} corners - a face has 3 or more", 3)
        _check_corners(polygon, f"faces[{i}]", vertex_count)
        polygons.append(polygon.astype(numpy.uint32))
    return numpy.concatenate(polygons), numpy.array([len(polygon) for polygon in polygons], numpy.uint32)


def to_colors(values, vertex_count):
    """Returns (n, 3) float32, sRGB in [0, 1]. values: real numbers in that range, or uint8; alpha, as in (n, 4), is left out."""
    array = _array(values, "colors", (vertex_count, -1), "fiu", "real numbers")
    if array.shape[1] not in (3, 4):
        raise Error(f"colors: has the shape {array.shape} - it must be ({vertex_count}, 3) or ({vertex_count}, 4)", 3)
    if array.dtype == numpy.uint8:
        array = array / numpy.float32(255)
    rows = to_reals(array[:, :3], "colors", (vertex_count, 3))
    if rows.size and not (0 <= rows.min() and rows.max() <= 1):
        raise Error(f"colors: {rows.min():g} to {rows.max():g} - floats must be 0 to 1, or use uint8 for 0 to 255", 3)
    return rows


def _check_corners(array, name, vertex_count):
    """Raises Error unless each number is the index of a vertex."""
    wrong = (array < 0) | (array >= vertex_count)
    if wrong.any():
        index = ", ".join(str(int(i)) for i in numpy.argwhere(wrong)[0])
        raise Error(f"{name}[{index}] is {array[wrong][0]} - there are vertices 0 to {vertex_count - 1}", 3)


def to_memory_mesh(mesh):
    """Converts a mesh (see is_mesh) to a MemoryMesh of the C++ module."""
    vertices, faces, colors = mesh_arrays(mesh)
    vertices = to_points(vertices, "vertices")
    corners, sizes = to_polygons(faces, len(vertices))
    colors = numpy.empty((0, 3), numpy.float32) if colors is None else to_colors(colors, len(vertices))
    return _polymorph.MemoryMesh(vertices, corners, sizes, colors)


class Models:
    """Meshes in memory that replace the model files of a scene while this object lives."""

    def __init__(self):
        self._models = _polymorph.Models()
        self._count = 0

    def replace(self, value):
        """Returns a scene's value with the path that add() gives in place of every mesh, and of every list of meshes."""
        if is_mesh(value):
            return {"model": self.add(value)}
        if isinstance(value, dict):
            return {key: self.add(inner) if key == "model" and not isinstance(inner, str) else self.replace(inner)
                    for key, inner in value.items()}
        if isinstance(value, (list, tuple)):
            return [self.replace(inner) for inner in value]
        return value

    def add(self, model):
        """Stores a mesh, or a list of meshes as a mesh sequence, and returns its path. Returns other values unchanged."""
        if not is_mesh(model) and not (isinstance(model, (list, tuple)) and len(model) and all(map(is_mesh, model))):
            return model
        self._count += 1
        name = f"mesh{self._count}"
        if is_mesh(model):
            return self._models.add(name, to_memory_mesh(model))
        return self._models.add_sequence(name, [_convert_numbered(i, mesh) for i, mesh in enumerate(model)])


def _convert_numbered(number, mesh):
    """Converts mesh `number` of a sequence. An error names the number."""
    try:
        return to_memory_mesh(mesh)
    except Error as error:
        raise Error(f"mesh {number}: {error}", error.code) from None


def is_mesh(value):
    """Tests for a Mesh, an object with vertices and faces (as in trimesh), or a tuple (vertices, faces[, colors])."""
    return mesh_arrays(value) is not None


def mesh_arrays(value):
    """Returns (vertices, faces, colors or None) of a mesh, and None for other values."""
    if isinstance(value, tuple) and len(value) in (2, 3) and all(map(_is_array, value[:2])):
        return (*value, None)[:3]
    for vertices, faces in (("positions", "triangles"), ("vertices", "faces")):
        if hasattr(value, vertices) and hasattr(value, faces):
            return getattr(value, vertices), getattr(value, faces), None
    return None


def _is_array(value):
    return isinstance(value, (list, tuple)) or hasattr(value, "ndim") and value.ndim > 0


def to_sequence(vertices, faces=None, colors=None):
    """Returns one mesh, or a list of meshes if vertices are a list or have one more dimension, for Models.add().

    vertices: (n, 3) of one mesh; (k, n, 3) or a list of (n, 3) of a sequence; without faces, a mesh or a list of meshes.
    faces, colors: the same for all meshes, or a list with one for each.
    """
    if faces is None:
        if colors is not None:
            raise Error("colors: give vertices and faces, or meshes (vertices, faces, colors)", 2)
        meshes = list(vertices) if isinstance(vertices, (list, tuple)) and not is_mesh(vertices) else vertices
        if isinstance(meshes, list) and not meshes:
            raise Error("vertices: the list is empty - give one mesh or more", 3)
        for mesh in meshes if isinstance(meshes, list) else [meshes]:
            if not is_mesh(mesh):
                raise Error("faces: are missing - give vertices and faces, or meshes", 2)
        return meshes
    if _depth(vertices) < 3:
        return (vertices, faces, colors)
    if not len(vertices):
        raise Error("vertices: the list is empty - give one mesh or more", 3)
    return list(zip(vertices, _per_mesh(faces, "faces", len(vertices)), _per_mesh(colors, "colors", len(vertices))))


def _per_mesh(values, name, count):
    """Returns a list of one value per mesh. A single value is repeated for all `count` meshes."""
    if values is None or _depth(values) < 3:
        return [values] * count
    if len(values) != count:
        raise Error(f"{name}: are those of {len(values)} meshes - there are vertices of {count}", 3)
    return values


def _depth(values):
    """Returns how deep lists and arrays are nested, by their first items: 2 for an array (n, 3) or a list of polygons."""
    depth = 0
    while not isinstance(values, (str, bytes)):
        if hasattr(values, "ndim"):
            return depth + values.ndim
        try:
            values = next(iter(values), None)
        except TypeError:
            break
        depth += 1
    return depth
