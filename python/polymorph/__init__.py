"""polymorph: morph sequences between polyhedra; models as spheres, and balls, meshes and frames as numpy arrays.

    import polymorph
    vertices, faces = polymorph.morph(v0, f0, v1, f1, 0.5)        # arrays in, arrays out
    pictures = polymorph.render([v0, v1], [f0, f1], dtype="uint8")  # (2, 480, 640, 4)
    scene = polymorph.Scene({"source": "teapot.obj", "target": "torus"})
    pixels, channels = scene.frame(12)

Lengths are in the units of the model, or of the scene that models are brought into. Frames are numbered from 1. The results
are the program's, bit for bit. All calls let other threads run and end within seconds of Ctrl-C; calls of one Scene wait for
each other. Failures raise Error.
"""
import html as _html
import json as _json
import operator as _operator
import os as _os
import pathlib as _pathlib
from typing import Any, Callable, Optional, Union

import numpy

_HERE = _pathlib.Path(__file__).resolve().parent
# A separate program reads glTF, FBX and other formats.
_os.environ.setdefault("POLYMORPH_ASSIMP", str(_HERE / "bin" / "polymorph_assimp"))

from . import _polymorph  # noqa: E402
from ._inputs import Models as _Models, is_mesh as _is_mesh, to_points as _to_points, to_polygons as _to_polygons  # noqa: E402
from ._inputs import to_sequence as _to_sequence  # noqa: E402
from ._progress import reporting as _reporting  # noqa: E402
from ._records import Approximation, Balls, Mesh, Plan  # noqa: E402
from .error import Error  # noqa: E402

__all__ = ["Approximation", "Balls", "Error", "Mesh", "Plan", "Scene", "analyze", "approximate", "data_folder", "identity",
           "morph", "render", "schema", "set_thread_count"]
__version__: str = _polymorph.version

# Limit in characters: larger pages would make notebooks slow to open and to save.
_MAX_NOTEBOOK_PAGE = 16 << 20

Progress = Union[None, bool, Callable[[str, float], Any]]
_Arrays = tuple[numpy.ndarray, numpy.ndarray]  # vertices and faces


def approximate(model, *, cache=None, progress: Progress = None, **settings) -> Approximation:
    """Approximates a model's inside by spheres and fits balls to it, in the model's own units.

    model: a path (OBJ, glTF, FBX, PLY, STL, DAE, OFF, 3DS), a Mesh, or "sphere", "cube", "torus", "puddle", "drops".
    cache, progress: as for Scene. settings: those of "spheres" in a scene, such as balls=128 (1 to 4096), method="medial",
    "hubbard", "octree" or "active", fit="ellipsoid", "round" or "none", error=0.005 (relative to the diagonal).
    Raises Error: a setting is unknown or out of its range, the model cannot be read, or has no inside.
    """
    models = _Models()
    with _reporting(progress) as report:
        source = models.replace(model)
        if not isinstance(source, dict):
            is_shape = source in ("sphere", "cube", "torus", "puddle", "drops")
            source = {"shape": source} if is_shape else {"model": _os.path.abspath(source)}
        text = _json.dumps({"source": {**source, "spheres": settings}, "target": "sphere"})
        result = _polymorph.approximate(text, _cache_folder(cache), report)
    return Approximation(result.pop("spheres"), Balls(**result))


class Scene:
    """A scene, loaded and prepared: models read, balls fitted, legs (morphs from one object to the next) planned.

    This takes seconds, or less with a cache.
    """

    def __init__(self, scene, *, set: Optional[dict] = None, device: str = "auto", cache=None, progress: Progress = None):
        """scene: the path of a scene file, or its JSON as a dict, whose paths are relative to the current folder. A model of a
            dict may be a Mesh, an object with arrays `vertices` and `faces`, or a tuple of arrays (vertices, faces) or
            (vertices, faces, colors), as render() takes them. A list of such meshes is a mesh sequence, numbered from 1.
        set: settings to change, as {"image.samples": 4}. device: "auto", "cpu", "cuda" or "cuda:1".
        cache: a folder; None: the program's own (POLYMORPH_CACHE_DIR); "": no cache.
        progress: a function that is called five times a second, in this thread, with the stage of the work and the seconds
            since its call began; an exception in it ends the call. True: a line by tqdm. False: nothing. None: the line in
            notebooks where tqdm is installed. It applies to this call and to the scene's methods.
        Raises Error: all that is wrong with the scene or a model, no such device, or not enough memory.
        """
        is_dict = isinstance(scene, dict)
        path = "scene.json" if is_dict else _os.fspath(scene)
        overrides = {key: value if isinstance(value, str) else _json.dumps(value) for key, value in (set or {}).items()}
        self._name = "a dict" if is_dict else repr(path)
        self._progress = progress
        self._models = _Models()
        with _reporting(progress) as report:
            text = _json.dumps(self._models.replace(scene)) if is_dict else ""
            self._scene = _polymorph.Scene(path, text, overrides, device, _cache_folder(cache), report)

    def __repr__(self) -> str:
        width, height = self.size
        return f"<polymorph.Scene of {self._name}: frames 1 to {self.frame_count}, {width} x {height}, on {self._scene.device}>"

    @property
    def frame_count(self) -> int:
        """Number of frames. They are numbered from 1."""
        return self._scene.frame_count

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of a frame, pixels."""
        return self._scene.width, self._scene.height

    @property
    def warnings(self) -> list[str]:
        """Problems of its models and textures, one line each."""
        return self._scene.warnings

    def balls(self, frame: int) -> Balls:
        """Returns the balls of all actors in a frame; none if the frame shows only models. Raises Error: no such frame, no memory."""
        with _reporting(self._progress) as report:
            return Balls(**self._scene.balls(frame, report))

    def mesh(self, frame: float) -> Mesh:
        """Returns the visible surfaces and models of all actors in a frame. 2.5 is half way between frames 2 and 3.

        Raises Error: no such frame, no memory.
        """
        with _reporting(self._progress) as report:
            return Mesh(**self._scene.mesh(frame, report))

    def field(self, frame: int, points, actor: int = 0) -> numpy.ndarray:
        """Evaluates the field that is 0 on the surface of a frame, at points, (m, 3) in scene units: (m,) float32.

        It is positive inside. With motion.interpolate "distance", it mixes the signed distances to both objects, in scene units;
        large distances are compressed. With "balls" it is the field of the balls divided by its value at the surface, minus 1.
        The field includes small components and superfluous handles, which the mesh leaves out. In a frame that shows a model,
        it is the field at that end of the leg. Raises Error: no such frame or actor; points with NaN.
        """
        with _reporting(self._progress) as report:
            return self._scene.field(frame, _to_points(points, "points"), actor, report)

    def frame(self, frame: int) -> tuple[numpy.ndarray, list[str]]:
        """Renders a frame. Returns float32 (height, width, channels), row 0 on top, and the channels' names.

        R, G, B and A come first: linear Rec. 709, alpha premultiplied. The layers of image.aovs follow, such as Z;
        docs/rendering.md has their units. An EXR file has these values rounded to half floats. Raises Error: no such frame, no memory.
        """
        with _reporting(self._progress) as report:
            return self._scene.frame(frame, report)

    def pictures(self, frames=None, *, dtype: Any = "float32") -> numpy.ndarray:
        """Renders frames, a list of numbers or None for all, to one array (frames, height, width, 4), row 0 on top.

        dtype: "float32": R, G, B and A as frame() has them, linear Rec. 709, alpha premultiplied. "uint8": as a PNG has them,
        sRGB, not premultiplied, with the scene's image.exposure, without dither.
        Raises Error: no such frame or dtype, no memory.
        """
        if dtype not in ("float32", "uint8", numpy.float32, numpy.uint8):
            raise Error(f"dtype: must be \"float32\" or \"uint8\", not {dtype!r}", 2)
        eight_bits = numpy.dtype(dtype) == numpy.uint8
        try:
            numbers = [_operator.index(number) for number in (range(1, self.frame_count + 1) if frames is None else frames)]
        except TypeError:
            raise Error(f"frames: must be a list of whole numbers, not {frames!r}", 2) from None
        width, height = self.size
        try:
            pictures = numpy.empty((len(numbers), height, width, 4), dtype)
        except MemoryError as error:
            raise Error(f"{len(numbers)} pictures of {width} x {height} do not fit into memory ({error}) - ask for fewer", 5) from None
        with _reporting(self._progress) as report:
            for i, number in enumerate(numbers):
                pictures[i] = self._scene.colors(number, eight_bits, report)
        return pictures

    def page(self) -> str:
        """Returns the HTML of a page that shows the morph in a browser, to turn and play, as `polymorph mesh --html` writes it.

        The page loads no other files. Raises Error: the scene has a mesh sequence, no memory.
        """
        with _reporting(self._progress) as report:
            return self._scene.page(report)

    def _repr_html_(self):
        """Returns the page for a notebook. None, if page() fails or the page is too large: the notebook then shows repr()."""
        try:
            page = self.page()
        except Error:
            return None
        if len(page) > _MAX_NOTEBOOK_PAGE:
            return None
        return (f'<iframe srcdoc="{_html.escape(page)}" sandbox="allow-scripts" '
                'style="width: 100%; height: 480px; border: 0"></iframe>')

    def analyze(self, frames: int = 0) -> list[dict]:
        """Measures the quality of each leg as `polymorph analyze` does.

        frames: number of evenly spaced times, 2 or more; 0: as many as the leg has frames.
        Returns a dict per leg: "actor", "from", "to"; "metrics": {name: {"value", "goal", "principle", "what"}}: the value
        (None if it cannot be measured) and, as texts, its goal, its principle and its definition; "frames": {name of a measure:
        array (frames,)}, of numbers, NaN where it cannot be measured, or of strings for the surfaces' digests.
        """
        try:
            frames = _operator.index(frames)
        except TypeError:
            raise Error(f"frames: must be a whole number, at how many even times to measure, not {frames!r}", 2) from None
        if frames < 0 or frames == 1:
            raise Error(f"frames: {frames} - a morph is measured at two times or more; 0: at as many as the leg has", 2)
        with _reporting(self._progress) as report:
            return _read_morphs(self._scene.analyze(frames, report))

    def plans(self) -> list[Plan]:
        """Returns the plan of each leg, actor by actor: which ball becomes which."""
        return [Plan(**{**plan, "source_balls": Balls(**plan["source_balls"]), "target_balls": Balls(**plan["target_balls"])})
                for plan in self._scene.plans()]


def morph(vertices0, faces0, vertices1, faces1, u, *, set: Optional[dict] = None, device: str = "auto", cache=None,
          progress: Progress = None, **settings) -> Union[_Arrays, list[_Arrays]]:
    """Makes meshes between two meshes: a pair (vertices, faces) for a number u, a list of pairs for an array of numbers.

    vertices0, faces0, vertices1, faces1: two meshes, as render() takes them. They stay in their places and sizes.
    u: time, from 0, the first mesh, to 1, the second. motion.easing sets the pace, which is slow at both ends by default, and
        constant with "linear".
    settings: the scene's other keys, as surface={"resolution": 64}, plan={"method": "index"}; set: single keys by their paths,
        as {"surface.resolution": 64}. schema() has all. device, cache, progress: as for Scene.
    Each pair: vertices (n, 3) float32 in the meshes' units, and faces (m, 3) uint32, counter-clockwise seen from outside, as
    from Scene.mesh(). At u = 0 and u = 1 the pair is the given mesh itself, vertex by vertex and face by face; if the given
    mesh has polygons, they are cut into triangles, and equal vertices are merged.
    Raises Error: arrays that are no mesh, u outside of 0 to 1, bad settings, not enough memory.
    """
    times = numpy.asarray(u)
    if times.dtype.kind not in "fiu" or times.ndim > 1 or not ((times >= 0) & (times <= 1)).all():
        raise Error(f"u: {u!r} - give a number from 0 to 1, or an array (k,) of such numbers", 2)
    for key in [*settings, *(set or {})]:
        if key.split(".")[0] in ("source", "target", "intermediate", "actors", "arrange"):
            raise Error(f"{key}: is what morph() itself makes of its arrays - use a Scene to choose it", 2)
    ends = [(vertices0, faces0), (vertices1, faces1)]
    scene = Scene({**settings, "source": {"model": ends[0]}, "target": {"model": ends[1]}, "arrange": "none"},
                  set=set, device=device, cache=cache, progress=progress)

    def mesh_at(time):
        if time in (0, 1) and (triangles := _triangles(ends[int(time)])):
            return triangles
        mesh = scene.mesh(1 + time * (scene.frame_count - 1))
        return mesh.positions, mesh.triangles

    return [mesh_at(float(time)) for time in times] if times.ndim else mesh_at(float(times))


def render(vertices, faces=None, *, colors=None, width: int = 640, height: int = 480, samples: int = 16,
           dtype: Any = "float32", set: Optional[dict] = None, device: str = "auto", cache=None, progress: Progress = None,
           **settings) -> numpy.ndarray:
    """Renders a mesh, (height, width, 4), or a list of meshes, (frames, height, width, 4), in the default studio; row 0 on top.

    vertices: (n, 3) real numbers; for a sequence (frames, n, 3), or a list of arrays (n, 3).
    faces: (m, 3) integers from 0, (m, k) for polygons, or a list of polygons; for a sequence, the same for all meshes, or a list
        with one for each. Without faces, vertices is a mesh, or a list of meshes, as in a scene's dict: Mesh, objects with
        `vertices` and `faces`, or tuples.
    colors: None, or (n, 3) or (n, 4), sRGB, floats 0 to 1 or uint8; for a sequence, for all meshes or for each. A face gets the
        mean colour of its vertices, in steps of 4/255; alpha is left out.
    dtype: "float32": linear Rec. 709, alpha premultiplied. "uint8": as a PNG has them: sRGB, not premultiplied, no dither.
    width, height: pixels. samples: per pixel. settings: the scene's other keys, as camera={"azimuth": 60}. set, device, cache,
        progress: as for Scene.
    A single mesh has several pictures if settings ask for frames, as frames={"turntable": 36}, which turns the camera around it.
    The camera's view and the height of the ground fit all meshes of a sequence, as in `polymorph render 'seq.####.obj'`.
    Raises Error: arrays that are no mesh, bad settings, not enough memory.
    """
    meshes = _to_sequence(vertices, faces, colors)
    is_sequence = isinstance(meshes, list)
    image = {"width": width, "height": height, "samples": samples, "aovs": "none", **settings.pop("image", {})}
    scene = Scene({**settings, "source": {"model": meshes if is_sequence else [meshes]}, "image": image},
                  set=set, device=device, cache=cache, progress=progress)
    pictures = scene.pictures(dtype=dtype)
    return pictures if is_sequence or len(pictures) > 1 else pictures[0]


def analyze(scene, faces=None, *, frames: int = 0, source=None, target=None, progress: Progress = None) -> dict:
    """Measures the quality of morphs as `polymorph analyze` does: {"morphs": [a dict as Scene.analyze() has it, ...]}.

    scene: a Scene, whose legs are measured at `frames` evenly spaced times; 0: as many as each leg has frames. Or a sequence of
        two or more meshes from any program, evenly spaced in time: vertices with `faces` as in render(), or the meshes.
    source, target: the objects of a sequence, as (vertices, faces); None: the first and the last mesh.
    progress: as for Scene. Raises Error: arrays that are no meshes, fewer than two, no morph in the scene.
    """
    if isinstance(scene, Scene):
        if faces is not None or source is not None or target is not None:
            raise Error("faces, source, target: are for meshes - a Scene has its own", 2)
        return {"morphs": scene.analyze(frames)}
    if frames:
        raise Error("frames: is for a Scene - of meshes each is a frame", 2)
    meshes = _to_sequence(scene, faces)
    if not isinstance(meshes, list) or len(meshes) < 2:
        raise Error("a morph has at least two frames - give a list of meshes", 3)
    models = _Models()
    for name, end in (("source", source), ("target", target)):
        if end is not None and not _is_mesh(end):
            raise Error(f"{name}: give a mesh (vertices, faces)", 2)
    first, last = ("" if end is None else models.add(end) for end in (source, target))
    with _reporting(progress) as report:
        return {"morphs": _read_morphs(_polymorph.analyze_meshes(models.add(meshes), first, last, report))}


def schema() -> dict:
    """Returns the JSON Schema of scenes."""
    return _json.loads(_polymorph.schema())


def identity() -> str:
    """Identifies this build: frames of the same scene and identity have the same bits."""
    return _polymorph.identity()


def set_thread_count(count: int) -> None:
    """Limits this process to `count` threads, up to 4096; 0: as many as it may use. Must be the first call."""
    _polymorph.set_thread_count(count)


def data_folder() -> _pathlib.Path:
    """Returns the folder of the models, effects and scenes that come with the program."""
    return _HERE / "share" / "polymorph"


def _triangles(mesh):
    """Returns a copy of a mesh (vertices, faces); None if not all faces are triangles."""
    vertices = _to_points(mesh[0], "vertices")
    corners, sizes = _to_polygons(mesh[1], len(vertices))
    return (vertices.copy(), corners.reshape(-1, 3).copy()) if (sizes == 3).all() else None


def _read_morphs(report):
    """Reads the morphs of a JSON report, and makes an array of each measure of the frames."""
    morphs = _json.loads(report)["morphs"]
    for entry in morphs:
        rows = entry["frames"]
        entry["frames"] = {name: _column([row[name] for row in rows]) for name in (rows[0] if rows else ())}
    return morphs


def _column(values) -> numpy.ndarray:
    """Makes an array of numbers, with NaN for None, or of strings."""
    return numpy.array([float("nan") if value is None else value for value in values])


def _cache_folder(cache) -> str:
    return _polymorph.default_cache_folder() if cache is None else _os.fspath(cache)


def __dir__():
    return [*__all__, "__version__", "__doc__", "__all__"]
