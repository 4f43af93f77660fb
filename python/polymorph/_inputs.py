"""Arrays that come in: their shape, type and values are checked, and whatever their strides, they become rows."""
import numpy

from . import _polymorph
from .error import Error


def _array(values, name, shape, kinds, wanted):
    if numpy.ma.is_masked(values):
        raise Error(f"{name}: has masked values - fill them or leave them out", 3)
    try:
        array = numpy.asarray(values)
    except ValueError as error:
        raise Error(f"{name}: not an array ({error})", 3) from None
    if array.dtype.kind not in kinds:
        raise Error(f"{name}: {wanted} are needed, not {array.dtype}", 3)
    if array.ndim != len(shape) or any(size not in (-1, found) for size, found in zip(shape, array.shape)):
        text = ", ".join("n" if size == -1 else str(size) for size in shape)
        raise Error(f"{name}: has the shape {array.shape} - it must be ({text}{',' if len(shape) == 1 else ''})", 3)
    return array


def reals_of(values, name, shape):
    """float32 of this shape (-1: any), in rows; finite."""
    array = _array(values, name, shape, "fiu", "real numbers")
    with numpy.errstate(over="ignore"):
        rows = numpy.ascontiguousarray(array, numpy.float32)
    finite = numpy.isfinite(rows)
    if not finite.all():
        place = tuple(int(i) for i in numpy.argwhere(~finite)[0])
        raise Error(f"{name}[{', '.join(map(str, place))}] is {array[place]} - all must be finite, and fit float32", 3)
    return rows


def points_of(values, name, count=-1):
    """(count, 3) float32."""
    return reals_of(values, name, (count, 3))


def faces_of(values, vertex_count):
    """(m, 3) uint32, each below vertex_count."""
    array = _array(values, "faces", (-1, 3), "iu", "integers")
    wrong = (array < 0) | (array >= vertex_count)
    if wrong.any():
        row, column = (int(i) for i in numpy.argwhere(wrong)[0])
        raise Error(f"faces[{row}, {column}] is {array[row, column]} - there are vertices 0 to {vertex_count - 1}", 3)
    return numpy.ascontiguousarray(array, numpy.uint32).copy()


def polygons_of(values, vertex_count):
    """Corners, one polygon after the other, and the size of each, uint32, of (m, k) integers or of a list of polygons."""
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
    polygons = []
    for i, row in enumerate(rows):
        polygon = _array(row, f"faces[{i}]", (-1,), "iu", "integers")
        if len(polygon) < 3:
            raise Error(f"faces[{i}] has {len(polygon)} corners - a face has 3 or more", 3)
        _check_corners(polygon, f"faces[{i}]", vertex_count)
        polygons.append(polygon.astype(numpy.uint32))
    return numpy.concatenate(polygons), numpy.array([len(polygon) for polygon in polygons], numpy.uint32)


def colors_of(values, vertex_count):
    """(n, 3) float32, sRGB in [0, 1], of real numbers in that range or of uint8; with alpha, (n, 4), which is left out."""
    array = _array(values, "colors", (vertex_count, -1), "fiu", "real numbers")
    if array.shape[1] not in (3, 4):
        raise Error(f"colors: has the shape {array.shape} - it must be ({vertex_count}, 3) or ({vertex_count}, 4)", 3)
    if array.dtype == numpy.uint8:
        array = array / numpy.float32(255)
    rows = reals_of(array[:, :3], "colors", (vertex_count, 3))
    if rows.size and not (0 <= rows.min() and rows.max() <= 1):
        raise Error(f"colors: {rows.min():g} to {rows.max():g} - floats must be 0 to 1, or use uint8 for 0 to 255", 3)
    return rows


def _check_corners(array, name, vertex_count):
    wrong = (array < 0) | (array >= vertex_count)
    if wrong.any():
        place = ", ".join(str(int(i)) for i in numpy.argwhere(wrong)[0])
        raise Error(f"{name}[{place}] is {array[wrong][0]} - there are vertices 0 to {vertex_count - 1}", 3)


def to_memory_mesh(mesh):
    """The module's own mesh of a Mesh, of what has vertices and faces like those of trimesh, or of a tuple of arrays."""
    vertices, faces, colors = parts_of(mesh)
    vertices = points_of(vertices, "vertices")
    corners, counts = polygons_of(faces, len(vertices))
    colors = numpy.empty((0, 3), numpy.float32) if colors is None else colors_of(colors, len(vertices))
    return _polymorph.MemoryMesh(vertices, corners, counts, colors)


class Models:
    """The meshes that stand in for a scene's models, which has them for as long as this object lives."""

    def __init__(self):
        self._models = _polymorph.Models()
        self._count = 0

    def replace(self, value):
        """The value with the path of a mesh in memory in the place of every mesh, or of a sequence of them in that of every list."""
        if is_mesh(value):
            return {"model": self.add(value)}
        if isinstance(value, dict):
            return {key: self.add(inner) if key == "model" and not isinstance(inner, str) else self.replace(inner)
                    for key, inner in value.items()}
        if isinstance(value, (list, tuple)):
            return [self.replace(inner) for inner in value]
        return value

    def add(self, model):
        """The path of a mesh, or of the sequence that a list of meshes is; other values as they are."""
        if not is_mesh(model) and not (isinstance(model, (list, tuple)) and len(model) and all(map(is_mesh, model))):
            return model
        self._count += 1
        name = f"mesh{self._count}"
        if is_mesh(model):
            return self._models.add(name, to_memory_mesh(model))
        return self._models.add_sequence(name, [_numbered(i, mesh) for i, mesh in enumerate(model)])


def _numbered(number, mesh):
    """The module's own mesh of one of a sequence, whose number an error tells."""
    try:
        return to_memory_mesh(mesh)
    except Error as error:
        raise Error(f"mesh {number}: {error}", error.code) from None


def is_mesh(value):
    """Is this a mesh: a Mesh, what has vertices and faces, or a tuple (vertices, faces) or (vertices, faces, colors)?"""
    return parts_of(value) is not None


def parts_of(value):
    """Vertices, faces and colours, None where there are none, of a mesh; None for other values."""
    if isinstance(value, tuple) and len(value) in (2, 3) and all(map(_is_array, value[:2])):
        return (*value, None)[:3]
    for vertices, faces in (("positions", "triangles"), ("vertices", "faces")):
        if hasattr(value, vertices) and hasattr(value, faces):
            return getattr(value, vertices), getattr(value, faces), None
    return None


def _is_array(value):
    return isinstance(value, (list, tuple)) or hasattr(value, "ndim") and value.ndim > 0


def sequence_of(vertices, faces=None, colors=None):
    """A mesh, or a list of meshes where a list or more dimensions than a mesh's are given, as what add() takes.

    vertices: a mesh, or a list of meshes, and then no faces; (n, 3), or (k, n, 3), or a list of (n, 3). faces and colors: of all
    meshes, or a list of one for each.
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
    return list(zip(vertices, _each(faces, "faces", len(vertices)), _each(colors, "colors", len(vertices))))


def _each(values, name, count):
    """One of `values` for each of `count` meshes, or the same for all."""
    if values is None or _depth(values) < 3:
        return [values] * count
    if len(values) != count:
        raise Error(f"{name}: are those of {len(values)} meshes - there are vertices of {count}", 3)
    return values


def _depth(values):
    """Nesting of lists and arrays, by their first items: 2 for an array (n, 3), or for a list of polygons."""
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
