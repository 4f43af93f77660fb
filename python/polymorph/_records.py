"""The records that calls return: named arrays, with their shapes and units."""
import dataclasses

import numpy

from . import _polymorph
from ._inputs import to_faces, to_points, to_reals
from .error import Error


class _Record:
    """Prints and pickles like a named tuple of arrays. Two records are equal only if they are the same object."""

    __slots__ = ()

    def __repr__(self):
        texts = []
        for name in self.__slots__:
            value = getattr(self, name)
            is_array = isinstance(value, numpy.ndarray)
            texts.append(f"{name}={value.dtype}{list(value.shape)}" if is_array else f"{name}={value!r}")
        return f"{type(self).__name__}({', '.join(texts)})"

    def __reduce__(self):
        return type(self), tuple(getattr(self, name) for name in self.__slots__)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Balls(_Record):
    """n balls, the sources of a field. The field is 1 at the surface and larger inside.

    In the default field a ball adds exp(w - a d^T S d) at the offset d from its centre (docs/method.md, Field). By default, the
    surface of a morph comes from both objects' distances, which move with the balls; Scene.field() evaluates them.
    """

    __slots__ = {
        "centers": "(n, 3) float32, in the units of the model or scene.",
        "a": "(n,) float32, > 0, 1 / length^2: how fast the ball's contribution falls with distance.",
        "w": "(n,) float32: the ball's strength; exp(w) is its contribution to the field at its centre.",
        "shapes": "(n, 3, 3) float32: S, symmetric, positive definite, determinant 1; the identity is a round ball.",
        "level": "(n,) float32: the field at the surface before w was changed so that it is 1 there.",
        "kind": "The field's name, as field.kind of a scene: \"gaussian\" by default.",
    }
    centers: numpy.ndarray
    a: numpy.ndarray
    w: numpy.ndarray
    shapes: numpy.ndarray
    level: numpy.ndarray
    kind: str

    def field(self, points) -> numpy.ndarray:
        """Evaluates the field at points, (m, 3): (m,) float32, 1 at the surface and more inside.

        Raises Error: arrays of another shape, of no real numbers, or with NaN.
        """
        n = len(to_reals(self.a, "a", (-1,)))
        return _polymorph.ball_field(
            to_points(self.centers, "centers", n), to_reals(self.a, "a", (n,)), to_reals(self.w, "w", (n,)),
            to_reals(self.shapes, "shapes", (n, 3, 3)).reshape(n, 9), self.kind, to_points(points, "points"))


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Mesh(_Record):
    """Triangles, counter-clockwise seen from outside. A scene and approximate() take it as a model."""

    __slots__ = {
        "positions": "(n, 3) float32, in the units of the model or scene.",
        "normals": "(n, 3) float32, unit, outward; (0, 3) for flat faces.",
        "triangles": "(m, 3) uint32, indices into positions.",
    }
    positions: numpy.ndarray
    normals: numpy.ndarray
    triangles: numpy.ndarray

    @classmethod
    def from_arrays(cls, vertices, faces) -> "Mesh":
        """Makes a mesh of vertices, (n, 3) real numbers, and faces, (m, 3) vertex numbers from 0. Arrays are copied.

        Raises Error: another shape or type, NaN, a number beyond +-1e15, or a face with a vertex that does not exist.
        """
        positions = to_points(vertices, "vertices").copy()
        if positions.size and numpy.abs(positions).max() > 1e15:
            raise Error(f"vertices: reach {numpy.abs(positions).max():g} - they must be within +-1e15", 3)
        return cls(positions, numpy.empty((0, 3), numpy.float32), to_faces(faces, len(positions)))


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Approximation(_Record):
    """A model as spheres, and as balls fitted to it."""

    __slots__ = {
        "spheres": "(n, 4) float32: x, y, z, radius > 0, in the model's units.",
        "balls": "Balls, fitted; none with fit=\"none\".",
    }
    spheres: numpy.ndarray
    balls: Balls


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Plan(_Record):
    """Which ball of one object becomes which ball of the next object of a scene."""

    __slots__ = {
        "actor": "The actor's name.",
        "source": "The name of the object that the leg starts from.",
        "target": "The name of the object that the leg leads to.",
        "pairs": "(k, 2) uint32: index of a ball of the source, and of the ball of the target that it becomes.",
        "shares": "(k, 2) float32, in (0, 1]: the share of either ball that the pair has; all shares of one ball sum to 1.",
        "masses": "(k,) float64: the pair's fraction of the total mass.",
        "source_balls": "Balls of the source.",
        "target_balls": "Balls of the target.",
    }
    actor: str
    source: str
    target: str
    pairs: numpy.ndarray
    shares: numpy.ndarray
    masses: numpy.ndarray
    source_balls: Balls
    target_balls: Balls


for _class in (Balls, Mesh, Approximation, Plan):
    _class.__module__ = "polymorph"
