"""Long calls, threads, arrays that come in, and what tools and people see of the module."""
import os
import pathlib
import pickle
import pydoc
import re
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import polymorph
from expect import raises

teapot = str(polymorph.data_folder() / "models/teapot.obj")
spider = str(polymorph.data_folder() / "models/spider.obj")
small = {"image.width": 32, "image.height": 24, "image.samples": 2, "frames.count": 6, "surface.resolution": 24,
         "spheres.balls": 24}


def scene_of(source, target="cube", **settings):
    return polymorph.Scene({"source": source, "target": target}, set={**small, **settings})


# Names, versions, types and words for people and tools.
assert re.fullmatch(r"\d+\.\d+\.\d+", polymorph.__version__)
assert set(polymorph.__all__) < set(dir(polymorph)) and not {"json", "os", "numpy"} & set(dir(polymorph))
folder = pathlib.Path(polymorph.__file__).parent
assert (folder / "py.typed").is_file()
stubs = (folder / "_polymorph.pyi").read_text()
for owner in (polymorph._polymorph, polymorph._polymorph.Scene, polymorph._polymorph.Models):
    for name in dir(owner):
        assert name.startswith("_") or re.search(rf"def {name}\(|^{name}:|^class {name}:", stubs, re.M), name
for record in (polymorph.Balls, polymorph.Mesh, polymorph.Approximation, polymorph.Plan):
    text = pydoc.plain(pydoc.render_doc(record))
    for field, words in record.__slots__.items():
        assert words in text, (record, field)

# Fields are evaluated at points; on the mesh they are what they are said to be.
by_balls = scene_of("torus", **{"motion.interpolate": "balls"})
assert repr(by_balls) == "<polymorph.Scene of a dict: frames 1 to 6, 32 x 24, on cpu>"
for frame in (3, 4):
    mesh, balls = by_balls.mesh(frame), by_balls.balls(frame)
    assert len(np.unique(balls.level)) == 1 and abs(balls.level[0] - 1) > 0.01, balls.level[0]
    on_mesh = balls.field(mesh.positions)
    assert abs(np.median(on_mesh) - 1) < 0.002 and np.abs(on_mesh - 1).mean() < 0.01, (on_mesh.min(), on_mesh.max())
    assert np.abs(by_balls.field(frame, mesh.positions) - (on_mesh - 1)).max() < 0.01
carried = scene_of("torus")
mesh = carried.mesh(3)
size = np.ptp(mesh.positions, axis=0).max()
assert np.abs(carried.field(3, mesh.positions)).max() < 0.01 * size
assert (carried.field(3, mesh.positions - 0.02 * size * mesh.normals) > 0).mean() > 0.99
assert (carried.field(3, mesh.positions + 0.02 * size * mesh.normals) < 0).mean() > 0.99
raises(2, "actors 0 to 0")(lambda: carried.field(3, mesh.positions, actor=1))
raises(2, "frames 1 to 6")(lambda: carried.field(0, mesh.positions))
# Alike actors share a leg: fields, meshes and balls of plans are where each stands.
twins = polymorph.Scene({"actors": [{"name": name, "source": "torus", "target": "cube", "translate": [x, 0, 0]} for name, x in (("a", 0), ("b", 9))]},
                        set=small)
second = twins.mesh(3).positions[twins.mesh(3).positions[:, 0] > 4.5]
assert len(second) and np.abs(twins.field(3, second, actor=1)).max() < 0.01 * size < np.abs(twins.field(3, second, actor=0)).min()
first_plan, second_plan = twins.plans()
for name in ("source_balls", "target_balls"):
    shift = getattr(second_plan, name).centers - getattr(first_plan, name).centers
    assert np.allclose(shift, (9, 0, 0), atol=1e-4), shift
copied = pickle.loads(pickle.dumps(balls))
assert np.array_equal(copied.w, balls.w) and "w=float32" in repr(copied) and (balls == copied) is False

# Plans and measures.
plan, = carried.plans()
assert (plan.source, plan.target) == ("torus", "cube") and plan.pairs.dtype == np.uint32
sums = np.zeros(len(plan.source_balls.a))
np.add.at(sums, plan.pairs[:, 0], plan.shares[:, 0])
assert np.allclose(sums, 1, atol=1e-5) and abs(plan.masses.sum() - 1) < 1e-6
morph, = carried.analyze(4)
assert morph["metrics"]["pop"]["value"] > 0 and morph["frames"]["volume"].shape == (4,)
assert morph["frames"]["volume"].dtype == np.float64 and (morph["frames"]["volume"] > 0).all()

# A blend, with keyframes of its weights: mesh, field, page, measures, plans to the first object by name.
weights = [{"easing": "linear", "keys": [{"frame": 1, "value": a}, {"frame": 3, "value": b}]} for a, b in ((1, 0), (0, 1), (0, 1))]
blend = polymorph.Scene({"blend": [{"shape": shape, "weight": weight} for shape, weight in zip(("cube", "torus", "sphere"), weights)],
                         "frames": {"count": 3}}, set={key: value for key, value in small.items() if not key.startswith("frames")})
assert blend.frame_count == 3 and [(plan.source, plan.target) for plan in blend.plans()] == [("cube", "sphere"), ("cube", "torus")]
for at in (2, 3):
    mesh = blend.mesh(at)
    size = np.ptp(mesh.positions, axis=0).max()
    assert np.abs(blend.field(at, mesh.positions)).mean() < 0.01 * size
    assert (blend.field(at, mesh.positions - 0.02 * size * mesh.normals) > 0).mean() > 0.98
    assert (blend.field(at, mesh.positions + 0.02 * size * mesh.normals) < 0).mean() > 0.98
alone = scene_of("cube").mesh(1)
assert np.array_equal(blend.mesh(1).positions, alone.positions) and np.array_equal(blend.mesh(1).triangles, alone.triangles)
assert not np.array_equal(blend.mesh(1.5).positions, blend.mesh(2).positions)
assert blend.frame(2)[0].shape[:2] == (24, 32) and len(blend.balls(2).a) == 0
measures, = blend.analyze()
assert measures["frames"]["volume"].shape == (3,)
assert '"space"' in blend.page()
array_blend = polymorph.Scene({"blend": [{"model": mesh, "weight": 1}, {"shape": "cube", "weight": 1}, {"shape": "torus", "weight": 2}]},
                              set=small)
assert len(array_blend.mesh(1).triangles) > 100
raises(3, "all weights are 0")(lambda: polymorph.Scene({"blend": [{"shape": "cube", "weight": 0}, {"shape": "torus", "weight": 0}]}))

# Arrays in: any strides and types; what is no mesh is named.
vertices = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
mesh = polymorph.Mesh.from_arrays(vertices, faces)
assert mesh.positions.dtype == np.float32 and mesh.triangles.dtype == np.uint32
strided = np.zeros((4, 6))[:, ::2]
strided[:] = vertices
backwards = np.array(faces, dtype=np.int16)[::-1]
turned = polymorph.Mesh.from_arrays(np.asfortranarray(strided), backwards)
assert np.array_equal(turned.positions, mesh.positions) and np.array_equal(turned.triangles, mesh.triangles[::-1])
four = polymorph.approximate(mesh, balls=4)
assert (four.spheres[:, :3] > 0).all()
scene = scene_of(mesh, {"model": turned, "rotate": [0, 90, 0]})
assert np.isfinite(scene.mesh(3).positions).all()
make = polymorph.Mesh.from_arrays
raises(3, "vertices: has the shape (4, 2)", "(n, 3)")(lambda: make(np.zeros((4, 2)), faces))
raises(3, "vertices: has the shape (12,)")(lambda: make(np.zeros(12), faces))
raises(3, "vertices[2, 1] is nan")(lambda: make([(0, 0, 0), (1, 0, 0), (0, float("nan"), 0)], [(0, 1, 2)]))
raises(3, "vertices[0, 0] is 1e+39", "float32")(lambda: make([(1e39, 0, 0)], np.zeros((0, 3), int)))
raises(3, "real numbers are needed, not complex")(lambda: make(np.zeros((4, 3), complex), faces))
raises(3, "real numbers are needed, not <U")(lambda: make([("a", "b", "c")], faces))
raises(3, "vertices: not an array")(lambda: make([(0, 0, 0), (1, 0)], faces))
raises(3, "integers are needed, not float64")(lambda: make(vertices, np.array(faces, float)))
raises(3, "faces[0, 1] is 4", "vertices 0 to 3")(lambda: make(vertices, [(0, 4, 1)]))
raises(3, "faces[0, 2] is -1")(lambda: make(vertices, [(0, 1, -1)]))
raises(3, "points[1, 2] is inf")(lambda: carried.field(3, [(0, 0, 0), (0, 0, float("inf"))]))
raises(3, "w: has the shape (3,)")(lambda: polymorph.Balls(
    four.balls.centers, four.balls.a, four.balls.w[:3], four.balls.shapes, four.balls.level, "gaussian").field([(0, 0, 0)]))
raises(2, "no field is called")(lambda: polymorph.Balls(
    four.balls.centers, four.balls.a, four.balls.w, four.balls.shapes, four.balls.level, "gauss").field([(0, 0, 0)]))

# One scene, many threads: they wait for each other.
pixels = carried.frame(3)[0]
found = [None] * 6


def render(i):
    found[i] = carried.frame(3)[0] if i % 2 else carried.mesh(3).positions


threads = [threading.Thread(target=render, args=(i,)) for i in range(6)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert all(np.array_equal(found[i], found[i % 2]) for i in range(6)) and np.array_equal(found[1], pixels)

# Memory and threads that are not there.
raises(5, "32768")(lambda: scene_of("torus", **{"image.width": 32768, "image.height": 32768}).frame(3))
raises(2, "-1 threads")(lambda: polymorph.set_thread_count(-1))
raises(2, "4097 threads")(lambda: polymorph.set_thread_count(4097))

if os.geteuid() == 0:  # a limit on processes does not count root's
    # For this thread and the call's, and none besides for TBB; then for this one alone.
    subprocess.run([sys.executable, "-B", "-c", """if True:
        import os, resource, polymorph
        os.setgid(65534)
        os.setuid(65534)
        polymorph.set_thread_count(4)
        for limit in (2, 1):
            resource.setrlimit(resource.RLIMIT_NPROC, (limit, limit))
            try:
                polymorph.Scene({"source": "torus", "target": "cube"}, cache="")
            except polymorph.Error as error:
                assert error.code == 5 and "no thread can be started" in str(error), error
            else:
                raise AssertionError(limit)
        """], check=True)

# Progress is told, and ends the call where it raises; Python's other threads run meanwhile.
stages, ticks = [], [0]


def count():
    while ticks[0] >= 0:
        ticks[0] += 1
        time.sleep(0.01)


counter = threading.Thread(target=count)
counter.start()
scene = polymorph.Scene({"source": teapot, "target": "torus"}, cache="", set=small,
                        progress=lambda stage, seconds: stages.append((stage, seconds)))
seen, ticks[0] = ticks[0], -1
counter.join()
assert seen > 20 and any("fitting" in stage for stage, _ in stages) and stages[-1][1] > stages[0][1] > 0.1, stages
raises(2, "progress")(lambda: polymorph.Scene("scene.json", progress=3))


class Enough(Exception):
    pass


def stop(stage, seconds):
    if seconds > 0.5:
        raise Enough


def ends_early(call, error):
    begin = time.process_time()
    try:
        call()
    except error:
        return time.process_time() - begin
    raise AssertionError("the call was not ended")


long_scene = {"source": spider, "target": teapot}
assert ends_early(lambda: polymorph.Scene(long_scene, cache="", progress=stop), Enough) < 4
# Ctrl-C; afterwards the module works as before.
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
for call in (lambda: polymorph.Scene(long_scene, cache=""), lambda: polymorph.approximate(spider, balls=2048, cache=""),
             lambda: scene_of("torus", **{"image.width": 3000, "image.height": 3000, "image.samples": 256}).frame(3)):
    timer = threading.Timer(1.5, signal.raise_signal, [signal.SIGINT])
    timer.start()
    used = ends_early(call, KeyboardInterrupt)
    assert used < 1.5 * (len(os.sched_getaffinity(0)) + 1) + 2, used
assert np.array_equal(carried.frame(3)[0], pixels)
print("calls of the Python module: ok")
