"""polymorph: morph sequences between polyhedra; models as spheres, and balls, meshes and frames as numpy arrays.

    import polymorph
    approximation = polymorph.approximate("teapot.obj", balls=128)
    scene = polymorph.Scene({"source": "teapot.obj", "target": "torus"})
    pixels, channels = scene.frame(12)

Lengths are in the units of the model, or of the scene that models are brought into. Frames are numbered from 1. The results
are the program's, bit for bit. All calls let other threads run, and one Scene serves one thread at a time.
"""
import dataclasses
import json
import os
import pathlib

import numpy

_HERE = pathlib.Path(__file__).resolve().parent
# The reader of glTF, FBX and other formats is a program beside this one.
os.environ.setdefault("POLYMORPH_ASSIMP", str(_HERE / "bin" / "polymorph_assimp"))

from . import _polymorph  # noqa: E402
from .error import Error  # noqa: E402

__all__ = ["Approximation", "Balls", "Error", "Mesh", "Scene", "approximate", "data_folder", "identity", "schema",
           "set_thread_count"]


@dataclasses.dataclass(frozen=True)
class Balls:
    """Sources of a field whose surface is where it is 1, inside above that. n balls, all arrays float32.

    With the scene's default field a ball adds exp(w - a d^T S d) at the distance d from its centre (docs/method.md, Field).
    """

    centers: numpy.ndarray  #: (n, 3)
    a: numpy.ndarray  #: (n,), > 0, 1 / length^2
    w: numpy.ndarray  #: (n,)
    shapes: numpy.ndarray  #: (n, 3, 3): S, symmetric, positive definite, determinant 1; the identity is a round ball


@dataclasses.dataclass(frozen=True)
class Mesh:
    """Triangles, counter-clockwise seen from outside."""

    positions: numpy.ndarray  #: (n, 3) float32
    normals: numpy.ndarray  #: (n, 3) float32, unit, outward; (0, 3) for flat faces
    triangles: numpy.ndarray  #: (m, 3) uint32, indices into positions


@dataclasses.dataclass(frozen=True)
class Approximation:
    """A model as spheres, and as balls fitted to it."""

    spheres: numpy.ndarray  #: (n, 4) float32: x, y, z, radius > 0
    balls: Balls  #: fitted; none with fit="none"


def approximate(model, *, cache=None, **settings) -> Approximation:
    """Approximates a model's inside by spheres and fits balls to it, in the model's own units.

    model: a path (OBJ, glTF, FBX, PLY, STL, DAE, OFF, 3DS), or "sphere", "cube", "torus", "puddle", "drops".
    cache: as for Scene. settings: those of "spheres" in a scene, such as balls=128 (1 to 4096), method="medial",
    "hubbard", "octree" or "active", fit="ellipsoid", "round" or "none", error=0.005 (a share of the diagonal).
    Raises Error: a setting is unknown or out of its range, the model cannot be read, or has no inside.
    """
    source = {"shape": model} if model in ("sphere", "cube", "torus", "puddle", "drops") else {"model": os.path.abspath(model)}
    text = json.dumps({"source": {**source, "spheres": settings}, "target": "sphere"})
    found = _polymorph.approximate(text, _cache_folder(cache))
    return Approximation(found.pop("spheres"), Balls(**found))


class Scene:
    """A scene, loaded and prepared: models read, balls fitted, legs planned. Seconds, or less where the cache has it."""

    def __init__(self, scene, *, set=None, device="auto", cache=None):
        """scene: the path of a scene file, or its JSON as a dict, whose paths are relative to the current folder.

        set: settings that are changed, as {"image.samples": 4}. device: "auto", "cpu", "cuda" or "cuda:1".
        cache: a folder; None: the program's own (POLYMORPH_CACHE_DIR); "": no cache.
        Raises Error: all that is wrong with the scene or a model, or no such device.
        """
        is_dict = isinstance(scene, dict)
        path = "scene.json" if is_dict else os.fspath(scene)
        overrides = {key: value if isinstance(value, str) else json.dumps(value) for key, value in (set or {}).items()}
        self._scene = _polymorph.Scene(path, json.dumps(scene) if is_dict else "", overrides, device, _cache_folder(cache))

    @property
    def frame_count(self) -> int:
        """Frames are 1 to frame_count."""
        return self._scene.frame_count

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of a frame, pixels."""
        return self._scene.width, self._scene.height

    @property
    def warnings(self) -> list[str]:
        """What is the matter with its models and textures, one line each."""
        return self._scene.warnings

    def balls(self, frame: int) -> Balls:
        """The balls of all actors in a frame; none while only models show. Raises Error: no such frame, no memory."""
        return Balls(**self._scene.balls(frame))

    def mesh(self, frame: int) -> Mesh:
        """What is seen of all actors in a frame: surfaces, models, or both. Raises Error: no such frame, no memory."""
        return Mesh(**self._scene.mesh(frame))

    def frame(self, frame: int) -> tuple[numpy.ndarray, list[str]]:
        """A rendered frame: float32 (height, width, channels), row 0 on top, and the channels' names.

        R, G, B and A come first: linear Rec. 709, alpha premultiplied. Then the layers that the scene asks for
        (image.aovs; docs/rendering.md has their units), such as Z. These are the values before they become the half floats of
        an EXR. Raises Error: no such frame, no memory.
        """
        return self._scene.frame(frame)


def schema() -> dict:
    """The JSON Schema of scenes."""
    return json.loads(_polymorph.schema())


def identity() -> str:
    """Which build this is; frames of the same scene and identity are the same bits."""
    return _polymorph.identity()


def set_thread_count(count: int) -> None:
    """Limits all work of this process to so many threads; 0: as many as it may use. Before the first other call."""
    _polymorph.set_thread_count(count)


def data_folder() -> pathlib.Path:
    """The models, effects and scenes that come with the program."""
    return _HERE / "share" / "polymorph"


def _cache_folder(cache) -> str:
    return _polymorph.default_cache_folder() if cache is None else os.fspath(cache)
