"""Arrays in, arrays out: morph(), render() and analyze(), against scenes of files and against the program."""
import html
import json
import pathlib
import re
import signal
import subprocess
import sys
import threading

import numpy as np
import polymorph

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from exr import Exr  # noqa: E402
from expect import raises  # noqa: E402

PROGRAM = pathlib.Path(polymorph.__file__).parent / "bin" / "polymorph"
small = {"surface": {"resolution": 24}, "spheres": {"balls": 12}}
tiny = {"width": 32, "height": 24, "samples": 2}


def torus(large=1.0, tube=0.4, around=24, across=12):
    """A closed torus of quads; vertices are float64."""
    u, v = np.meshgrid(np.arange(around) * 2 * np.pi / around, np.arange(across) * 2 * np.pi / across, indexing="ij")
    ring = large + tube * np.cos(v)
    vertices = np.stack([ring * np.cos(u), tube * np.sin(v), ring * np.sin(u)], axis=-1).reshape(-1, 3)
    i, j = (axis.reshape(-1) for axis in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    index = lambda a, b: (a % around) * across + b % across  # noqa: E731
    return vertices, np.stack([index(i, j), index(i, j + 1), index(i + 1, j + 1), index(i + 1, j)], axis=-1)


def halves(quads):
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def write_obj(path, vertices, faces):
    with open(path, "w", encoding="ascii") as file:
        file.writelines("v %.9g %.9g %.9g\n" % tuple(v) for v in np.asarray(vertices, np.float32))
        file.writelines("f %s\n" % " ".join(str(int(i) + 1) for i in face) for face in faces)


def volume(vertices, faces):
    a, b, c = (vertices[faces[:, i]].astype(float) for i in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


ring, quads = torus()
triangles = halves(quads)
box = np.array([(x, y, z) for x in (0, 2) for y in (0, 1) for z in (0, 1)], float)
box_faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
box_triangles = halves(np.array(box_faces))

# A morph: its ends are the arrays, what is between is the scene's, whatever the arrays' types and strides.
between = polymorph.morph(ring, triangles, box, box_triangles, [0, 0.25, 0.5, 1], **small)
for (vertices, faces), (given, given_faces) in ((between[0], (ring, triangles)), (between[3], (box, box_triangles))):
    assert vertices.dtype == np.float32 and faces.dtype == np.uint32
    assert np.array_equal(vertices, given.astype(np.float32)) and np.array_equal(faces, given_faces)
for vertices, faces in between[1:3]:
    assert vertices.dtype == np.float32 and faces.dtype == np.uint32 and faces.shape[1] == 3 and faces.max() == len(vertices) - 1
    assert 0.8 < volume(vertices, faces) / volume(box, box_triangles) < 2.5
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()  # closed
write_obj("ring.obj", ring, triangles)
write_obj("box.obj", box, box_triangles)
files = polymorph.Scene({"source": "ring.obj", "target": "box.obj", "arrange": "none", **small, "frames": {"count": 9}})
for u, frame in ((0.25, 3), (0.5, 5)):
    mesh = files.mesh(frame)
    vertices, faces = polymorph.morph(ring[::-1][::-1], triangles.astype(np.int16), box.tolist(), box_triangles.tolist(), u,
                                      set={"frames.count": 9}, **small)
    assert np.array_equal(vertices, mesh.positions) and np.array_equal(faces, mesh.triangles)
assert np.array_equal(between[2][0], files.mesh(5).positions)
assert np.array_equal(files.mesh(5.0).positions, files.mesh(5).positions)
one, two, three = (files.mesh(frame).positions.mean(axis=0) for frame in (4, 4.5, 5))
assert np.linalg.norm(two - (one + three) / 2) < np.linalg.norm(three - one)
finer = polymorph.morph(ring, triangles, box, box_triangles, 0.5, surface={"resolution": 40}, spheres={"balls": 12})
assert len(finer[1]) > 1.5 * len(between[2][1])
# Polygons: the same surface, cut into triangles.
by_quads = polymorph.morph(ring, quads, box, box_faces, [0, 1], **small)
assert abs(volume(*by_quads[0]) - volume(ring.astype(np.float32), triangles)) < 0.01 and len(by_quads[1][1]) == 12
mixed = [*box_faces[1:], (0, 1, 3), (0, 3, 2)]
assert len(polymorph.morph(box, mixed, ring, quads, 0.0, **small)[1]) == 12
raises(2, "u: 1.5")(lambda: polymorph.morph(ring, triangles, box, box_triangles, 1.5))
raises(2, "u: nan")(lambda: polymorph.morph(ring, triangles, box, box_triangles, float("nan")))
raises(2, "arrange", "Scene")(lambda: polymorph.morph(ring, triangles, box, box_triangles, 0.5, arrange="stand"))
raises(2, "source.rotate")(lambda: polymorph.morph(ring, triangles, box, box_triangles, 0.5, set={"source.rotate": [0, 9, 0]}))
raises(3, "resolutoin")(lambda: polymorph.morph(ring, triangles, box, box_triangles, 0.5, surface={"resolutoin": 9}))
raises(3, "mesh2.faces", "no area")(lambda: polymorph.morph(ring, triangles, 0 * box, box_triangles, 0.5))

# Meshes that are none.
raises(3, "vertices[1, 0] is nan")(lambda: polymorph.render([(0, 0, 0), (float("nan"), 0, 0), (0, 1, 0)], [(0, 1, 2)]))
raises(3, "vertices: has masked values")(lambda: polymorph.render(np.ma.masked_greater(box, 1), box_triangles))
raises(3, "vertices: reach 2e+20", "1e15")(lambda: polymorph.Mesh.from_arrays(box * 1e20, box_triangles))
raises(3, "vertices: has the shape (8, 2)")(lambda: polymorph.render(box[:, :2], box_triangles))
raises(3, "faces[0, 2] is 8", "vertices 0 to 7")(lambda: polymorph.render(box, [(0, 1, 8)]))
raises(3, "faces[1][3] is -1")(lambda: polymorph.render(box, [(0, 1, 2), (0, 1, 3, -1)]))
raises(3, "faces[1] has 2 corners")(lambda: polymorph.render(box, [(0, 1, 2), (0, 1)]))
raises(3, "faces: has the shape (3,)")(lambda: polymorph.render(box, [0, 1, 2]))
raises(3, "faces: has the shape (1, 2)")(lambda: polymorph.render(box, [(0, 1)]))
raises(3, "integers are needed, not float64")(lambda: polymorph.render(box, box_triangles * 1.0))
raises(3, "no faces")(lambda: polymorph.render(box, np.zeros((0, 3), int)))
raises(3, "vertex 1 has the coordinate 1e+20")(lambda: polymorph.render(box * 1e20, box_triangles))
raises(3, "faces: are those of 1 meshes - there are vertices of 2")(lambda: polymorph.render([box, box], [box_triangles]))
raises(3, "the list is empty")(lambda: polymorph.render([]))
raises(2, "faces: are missing")(lambda: polymorph.render(box))
raises(3, "mesh 1: vertices[0, 0] is nan")(lambda: polymorph.render([box, box * np.nan], box_triangles))
raises(3, "colors: has the shape (7, 3)")(lambda: polymorph.render(box, box_triangles, colors=np.zeros((7, 3))))
raises(3, "floats must be 0 to 1")(lambda: polymorph.render(box, box_triangles, colors=np.full((8, 3), 255.0)))
raises(2, "dtype", "uint16")(lambda: polymorph.render(box, box_triangles, dtype="uint16"))
raises(3, "image/width")(lambda: polymorph.render(box, box_triangles, width=0))

# Pictures: one mesh, and a sequence, which is framed once, as the program frames its files.
picture = polymorph.render(ring, quads, **tiny)
assert picture.shape == (24, 32, 4) and picture.dtype == np.float32 and np.isfinite(picture).all()
meshes = [(ring * scale, quads) for scale in (0.5, 1, 1.5)]
film = polymorph.render([vertices for vertices, _ in meshes], quads, **tiny)
assert film.shape == (3, 24, 32, 4) and not np.array_equal(film[0], film[1])
assert np.array_equal(film, polymorph.render(np.stack([vertices for vertices, _ in meshes]), [quads] * 3, **tiny))
assert np.array_equal(film, polymorph.render(meshes, **tiny))
for number, (vertices, faces) in enumerate(meshes, start=1):
    write_obj(f"seq.{number:04}.obj", vertices, faces)
sizes = [f"--set=image.{key}={value}" for key, value in tiny.items()]
subprocess.run([PROGRAM, "render", "seq.####.obj", "-o", "seq.####.exr", "-q", *sizes], check=True)
for number in range(3):
    written = Exr(f"seq.{number + 1:04}.exr")
    for i, name in enumerate("RGBA"):
        rows = np.array(written.channels[name], dtype=np.float32)
        assert np.array_equal(film[number, ..., i].astype(np.float16).astype(np.float32), rows), (number, name)
assert np.abs(polymorph.render(*meshes[0], **tiny) - film[0]).max() > 0.1  # alone, it fills the picture
exposed = polymorph.render(ring, quads, dtype="uint8", set={"image.transparent": True, "image.exposure": 1}, **tiny)
linear = polymorph.render(ring, quads, set={"image.transparent": True, "image.exposure": 1}, **tiny).astype(float)
assert exposed.shape == (24, 32, 4) and exposed.dtype == np.uint8 and {0, 255} <= set(exposed[..., 3].flat)
straight = np.clip(2 * linear[..., :3] / np.maximum(linear[..., 3:], 1e-9), 0, 1)
encoded = np.where(straight <= 0.0031308, 12.92 * straight, 1.055 * straight ** (1 / 2.4) - 0.055)
assert np.abs(exposed[..., :3] - 255 * encoded)[linear[..., 3] > 0].max() < 0.51
assert np.abs(exposed[..., 3] - 255 * linear[..., 3]).max() < 0.51
turn = polymorph.render(ring * [1, 1, 2], quads, frames={"turntable": 4}, **tiny)
assert turn.shape == (4, 24, 32, 4) and not np.array_equal(turn[0], turn[1])
# Colours: of uint8 and of floats, with alpha and without; settings by keyword.
red = np.tile(np.array([255, 0, 0, 255], np.uint8), (len(ring), 1))
painted = polymorph.render(ring, quads, colors=red, **tiny)
assert np.array_equal(painted, polymorph.render(ring, quads, colors=red[:, :3] / 255, **tiny))
middle = (painted - picture)[8:16, 8:24]
assert middle[..., 0].mean() > middle[..., 1].mean() + 0.02 and middle[..., 1].mean() < -0.02
both = polymorph.render([ring, ring], quads, colors=[red, red // 2], **tiny)
assert np.array_equal(both[0], painted) and not np.array_equal(both[1], painted)
assert not np.array_equal(polymorph.render(ring, quads, camera={"azimuth": 90}, ground={"enabled": False}, **tiny), picture)
# A sequence moves in a morph, and the scene has its meshes after the call.
moving = polymorph.Scene({"source": {"model": [(ring * s, quads) for s in (1, 1.1, 1.2)]}, "target": "cube", **small,
                          "frames": {"count": 4}})
assert not np.array_equal(moving.mesh(1).positions, moving.mesh(2).positions)

# Measures: of a scene, and of meshes as the program has them.
measured = polymorph.analyze(files, frames=3)
assert list(measured) == ["morphs"] and measured["morphs"][0]["frames"]["volume"].shape == (3,)
assert json.dumps(measured["morphs"][0]["metrics"]) == json.dumps(files.analyze(3)[0]["metrics"])
rows = polymorph.analyze([vertices for vertices, _ in meshes], quads)["morphs"]
told = json.loads(subprocess.run([PROGRAM, "analyze", "seq.####.obj", "--json"], check=True, capture_output=True).stdout)["morphs"]
assert len(rows) == 1 and rows[0]["metrics"] == told[0]["metrics"]
assert rows[0]["frames"]["volume"].tolist() == [frame["volume"] for frame in told[0]["frames"]]
assert (np.diff(rows[0]["frames"]["volume"]) > 0).all()
ends = polymorph.analyze(meshes, source=meshes[0], target=(box, box_triangles))["morphs"][0]
assert ends["metrics"] != rows[0]["metrics"]
raises(3, "at least two frames")(lambda: polymorph.analyze([(ring, quads)]))
raises(3, "at least two frames")(lambda: polymorph.analyze(ring, quads))
for times in (-1, 1):
    raises(2, "two times or more")(lambda times=times: files.analyze(times))
for times in ([1, 2], 2.5, "3"):
    raises(2, "frames: must be a whole number")(lambda times=times: files.analyze(times))
assert files.pictures([1], dtype=np.uint8).dtype == np.uint8
raises(2, "dtype")(lambda: files.pictures([1], dtype="int16"))
raises(2, "whole numbers")(lambda: files.pictures(["a"]))
raises(2, "a Scene has its own")(lambda: polymorph.analyze(files, target=(ring, quads)))
raises(2, "source: give a mesh")(lambda: polymorph.analyze(meshes, source="ring.obj"))

# In a notebook.
page = files.page()
assert page.lower().startswith("<!doctype html>") and len(page) > 10000
shown = files._repr_html_()
assert html.unescape(re.fullmatch(r'<iframe srcdoc="([^"]*)" [^>]*></iframe>', shown)[1]) == page
assert moving._repr_html_() is None
raises(3, "mesh sequence")(moving.page)


# Progress, and an end by it; threads.
class Enough(Exception):
    pass


def stop(stage, seconds):
    raise Enough(stage)


for call in (lambda: polymorph.morph(ring, quads, box, box_faces, 0.5, cache="", progress=stop, surface={"resolution": 256}),
             lambda: polymorph.render(ring, quads, width=2000, height=2000, samples=64, progress=stop),
             lambda: polymorph.analyze([torus(around=400, across=200)] * 3, progress=stop)):
    try:
        call()
    except Enough as enough:
        assert str(enough)
    else:
        raise AssertionError("the call was not ended")
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
timer = threading.Timer(1, signal.raise_signal, [signal.SIGINT])
timer.start()
try:
    polymorph.render(ring, quads, width=3000, height=3000, samples=256)
except KeyboardInterrupt:
    pass
else:
    raise AssertionError("Ctrl-C did not end the call")
found = [None] * 4


def work(i):
    found[i] = polymorph.render(ring, quads, **tiny) if i % 2 else polymorph.morph(ring, triangles, box, box_triangles, 0.5, **small)[0]


threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert np.array_equal(found[1], picture) and np.array_equal(found[3], picture)
assert np.array_equal(found[0], found[2]) and np.array_equal(found[0], between[2][0])
print("arrays of the Python module: ok")
