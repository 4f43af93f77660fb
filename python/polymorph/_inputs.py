"""Arrays that come in: their shape, type and values are checked, and whatever their strides, they become rows."""
import os
import tempfile

import numpy

from .error import Error


def _array(values, name, shape, kinds, wanted):
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


class ModelFolder:
    """A folder of the meshes that stand in for a scene's models, for as long as they are read."""

    def __init__(self):
        self._folder = tempfile.TemporaryDirectory(prefix="polymorph-")
        self._count = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._folder.cleanup()

    def replace(self, value):
        """The value with the path of a file in the place of every mesh."""
        if _is_mesh(value):
            return {"model": self.save(value)}
        if isinstance(value, dict):
            return {key: self.save(inner) if key == "model" and _is_mesh(inner) else self.replace(inner)
                    for key, inner in value.items()}
        if isinstance(value, (list, tuple)):
            return [self.replace(inner) for inner in value]
        return value

    def save(self, mesh):
        """Writes a Mesh, or what has vertices and faces like those of trimesh, as OBJ; floats are exact."""
        vertices, faces = _parts(mesh)
        vertices = points_of(vertices, "vertices")
        faces = faces_of(faces, len(vertices))
        self._count += 1
        path = os.path.join(self._folder.name, f"mesh{self._count}.obj")
        with open(path, "w", encoding="ascii") as file:
            numpy.savetxt(file, vertices, "v %.9g %.9g %.9g")
            numpy.savetxt(file, faces.astype(numpy.int64) + 1, "f %d %d %d")
        return path


def _is_mesh(value):
    return _parts(value) is not None


def _parts(value):
    for vertices, faces in (("positions", "triangles"), ("vertices", "faces")):
        if hasattr(value, vertices) and hasattr(value, faces):
            return getattr(value, vertices), getattr(value, faces)
    return None
