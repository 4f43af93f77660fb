"""polymorph: morph sequences between polyhedra; models as spheres, and balls, meshes and frames as numpy arrays.

    import polymorph
    approximation = polymorph.approximate("teapot.obj", balls=128)
    scene = polymorph.Scene({"source": "teapot.obj", "target": "torus"})
    pixels, channels = scene.frame(12)

Lengths are in the units of the model, or of the scene that models are brought into. Frames are numbered from 1. The results
are the program's, bit for bit. All calls let other threads run and end within seconds of Ctrl-C; calls of one Scene wait for
each other. Failures raise Error.
"""
import json as _json
import os as _os
import pathlib as _pathlib
from typing import Any, Callable, Optional, Union

import numpy

_HERE = _pathlib.Path(__file__).resolve().parent
# The reader of glTF, FBX and other formats is a program beside this one.
_os.environ.setdefault("POLYMORPH_ASSIMP", str(_HERE / "bin" / "polymorph_assimp"))

from . import _polymorph  # noqa: E402
from ._inputs import ModelFolder as _ModelFolder, points_of as _points_of  # noqa: E402
from ._progress import reporting as _reporting  # noqa: E402
from ._records import Approximation, Balls, Mesh, Plan  # noqa: E402
from .error import Error  # noqa: E402

__all__ = ["Approximation", "Balls", "Error", "Mesh", "Plan", "Scene", "approximate", "data_folder", "identity", "schema",
           "set_thread_count"]
__version__: str = _polymorph.version

Progress = Union[None, bool, Callable[[str, float], Any]]


def approximate(model, *, cache=None, progress: Progress = None, **settings) -> Approximation:
    """Approximates a model's inside by spheres and fits balls to it, in the model's own units.

    model: a path (OBJ, glTF, FBX, PLY, STL, DAE, OFF, 3DS), a Mesh, or "sphere", "cube", "torus", "puddle", "drops".
    cache, progress: as for Scene. settings: those of "spheres" in a scene, such as balls=128 (1 to 4096), method="medial",
    "hubbard", "octree" or "active", fit="ellipsoid", "round" or "none", error=0.005 (a share of the diagonal).
    Raises Error: a setting is unknown or out of its range, the model cannot be read, or has no inside.
    """
    with _ModelFolder() as folder, _reporting(progress) as report:
        source = folder.replace(model)
        if not isinstance(source, dict):
            is_shape = source in ("sphere", "cube", "torus", "puddle", "drops")
            source = {"shape": source} if is_shape else {"model": _os.path.abspath(source)}
        text = _json.dumps({"source": {**source, "spheres": settings}, "target": "sphere"})
        found = _polymorph.approximate(text, _cache_folder(cache), report)
    return Approximation(found.pop("spheres"), Balls(**found))


class Scene:
    """A scene, loaded and prepared: models read, balls fitted, legs planned. Seconds, or less where the cache has it."""

    def __init__(self, scene, *, set: Optional[dict] = None, device: str = "auto", cache=None, progress: Progress = None):
        """scene: the path of a scene file, or its JSON as a dict, whose paths are relative to the current folder. A model of a
            dict may be a Mesh, or an object with arrays `vertices` and `faces`.
        set: settings that are changed, as {"image.samples": 4}. device: "auto", "cpu", "cuda" or "cuda:1".
        cache: a folder; None: the program's own (POLYMORPH_CACHE_DIR); "": no cache.
        progress: a function that is called five times a second, in this thread, with the stage of the work and the seconds
            since its call began; an exception in it ends the call. True: a line by tqdm. False: nothing. None: the line in
            notebooks where tqdm is installed. It counts for this call and for the scene's methods.
        Raises Error: all that is wrong with the scene or a model, no such device, or not enough memory.
        """
        is_dict = isinstance(scene, dict)
        path = "scene.json" if is_dict else _os.fspath(scene)
        overrides = {key: value if isinstance(value, str) else _json.dumps(value) for key, value in (set or {}).items()}
        self._name = "a dict" if is_dict else repr(path)
        self._progress = progress
        with _ModelFolder() as folder, _reporting(progress) as report:
            text = _json.dumps(folder.replace(scene)) if is_dict else ""
            self._scene = _polymorph.Scene(path, text, overrides, device, _cache_folder(cache), report)

    def __repr__(self) -> str:
        width, height = self.size
        return f"<polymorph.Scene of {self._name}: frames 1 to {self.frame_count}, {width} x {height}, on {self._scene.device}>"

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
        with _reporting(self._progress) as report:
            return Balls(**self._scene.balls(frame, report))

    def mesh(self, frame: int) -> Mesh:
        """What is seen of all actors in a frame: surfaces, models, or both. Raises Error: no such frame, no memory."""
        with _reporting(self._progress) as report:
            return Mesh(**self._scene.mesh(frame, report))

    def field(self, frame: int, points, actor: int = 0) -> numpy.ndarray:
        """Evaluates the field whose zero the surface of a frame is, at points, (m, 3) in scene units: (m,) float32.

        It is positive inside. Between objects that are mixed by their distances (motion.interpolate "distance"), it is that
        mixture in scene units: a distance near the objects, compressed further away. Between balls it is their field divided by
        its level, minus 1. Small components and superfluous handles, which the mesh leaves out, are in it. In a frame that
        shows a model, it belongs to the end of the leg. Raises Error: no such frame or actor; points with NaN.
        """
        with _reporting(self._progress) as report:
            return self._scene.field(frame, _points_of(points, "points"), actor, report)

    def frame(self, frame: int) -> tuple[numpy.ndarray, list[str]]:
        """A rendered frame: float32 (height, width, channels), row 0 on top, and the channels' names.

        R, G, B and A come first: linear Rec. 709, alpha premultiplied. Then the layers that the scene asks for
        (image.aovs; docs/rendering.md has their units), such as Z. These are the values before they become the half floats of
        an EXR. Raises Error: no such frame, no memory.
        """
        with _reporting(self._progress) as report:
            return self._scene.frame(frame, report)

    def analyze(self, frames: int = 0) -> list[dict]:
        """Measures the quality of each leg at `frames` even times, 0: as many as the leg has, as `polymorph analyze` does.

        A dict per leg: "actor", "from", "to"; "metrics": {name: {"value", "goal", "principle", "what"}}, value None where it
        cannot be measured; "frames": {name of a measure: (frames,) array of numbers, NaN where it cannot be measured, but for
        the surfaces' digests}.
        """
        with _reporting(self._progress) as report:
            morphs = _json.loads(self._scene.analyze(frames, report))["morphs"]
        for morph in morphs:
            rows = morph["frames"]
            morph["frames"] = {name: _column([row[name] for row in rows]) for name in (rows[0] if rows else ())}
        return morphs

    def plans(self) -> list[Plan]:
        """Which ball becomes which: a Plan per leg, actor by actor."""
        return [Plan(**{**plan, "source_balls": Balls(**plan["source_balls"]), "target_balls": Balls(**plan["target_balls"])})
                for plan in self._scene.plans()]


def schema() -> dict:
    """The JSON Schema of scenes."""
    return _json.loads(_polymorph.schema())


def identity() -> str:
    """Which build this is; frames of the same scene and identity are the same bits."""
    return _polymorph.identity()


def set_thread_count(count: int) -> None:
    """Limits all work of this process to so many threads, up to 4096; 0: as many as it may use. Before the first other call."""
    _polymorph.set_thread_count(count)


def data_folder() -> _pathlib.Path:
    """The models, effects and scenes that come with the program."""
    return _HERE / "share" / "polymorph"


def _column(values) -> numpy.ndarray:
    return numpy.array([float("nan") if value is None else value for value in values])


def _cache_folder(cache) -> str:
    return _polymorph.default_cache_folder() if cache is None else _os.fspath(cache)


def __dir__():
    return [*__all__, "__version__", "__doc__", "__all__"]
