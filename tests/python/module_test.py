"""`import polymorph`, tried in the folder where wheel_test.sh left scene.json and its frames."""
import pathlib
import sys

import numpy as np
import polymorph

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from exr import Exr  # noqa: E402
from expect import raises  # noqa: E402

# A cube of side 2 that stands on the floor: the spheres lie in it and fill most of it; the balls' surface is where the field is 1.
cube = polymorph.approximate("cube", balls=40)
assert cube.spheres.dtype == np.float32 and cube.spheres.shape[1] == 4 and len(cube.spheres) >= 8
middle = np.array([0, 1, 0])
assert (np.abs(cube.spheres[:, :3] - middle) < 1).all() and (cube.spheres[:, 3] > 0).all()
balls = cube.balls
n = len(balls.a)
assert n == 40 and balls.centers.shape == (n, 3) and balls.w.shape == (n,) and balls.shapes.shape == (n, 3, 3)
assert np.allclose(np.linalg.det(balls.shapes.astype(float)), 1, atol=1e-3)
assert balls.kind == "gaussian" and (balls.level == 1).all()


def field(points):
    d = points[:, None, :] - balls.centers[None]
    return np.exp(balls.w - balls.a * np.einsum("pbi,bij,pbj->pb", d, balls.shapes, d)).sum(axis=1)


rng = np.random.default_rng(1)
points = middle + rng.uniform(-1.5, 1.5, (4000, 3))
inside = (np.abs(points - middle) < 1).all(axis=1)
assert ((field(points) > 1) == inside).mean() > 0.95, ((field(points) > 1) == inside).mean()
# The module's own evaluation of it leaves out what is below 1e-4 of the surface's level, for each ball.
assert np.abs(balls.field(points) - field(points)).max() < 40 * 1e-4
assert len(polymorph.approximate("cube", balls=10, fit="none").balls.a) == 0
raises(3, "/source/spheres/bals: unknown key")(lambda: polymorph.approximate("cube", bals=3))
raises(3, "nowhere.obj")(lambda: polymorph.approximate("nowhere.obj"))
# A format of the model reader, which is a program beside the module.
with open("four.stl", "w", encoding="ascii") as file:
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    file.write("solid four\n")
    for face in [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]:
        file.write("facet normal 0 0 0\nouter loop\n")
        file.writelines("vertex %g %g %g\n" % corners[i] for i in face)
        file.write("endloop\nendfacet\n")
    file.write("endsolid four\n")
four = polymorph.approximate("four.stl", balls=4)
assert (four.spheres[:, :3] > 0).all() and (four.spheres[:, :3].sum(axis=1) < 1).all()

scene = polymorph.Scene("scene.json")
assert scene.frame_count == 6 and scene.size == (32, 24) and scene.warnings == []
mesh = scene.mesh(3)
assert mesh.positions.dtype == np.float32 and mesh.triangles.dtype == np.uint32
assert mesh.normals.shape == mesh.positions.shape and mesh.triangles.max() == len(mesh.positions) - 1
# Closed, and it looks outward: the signed volume is that of something of the cube's size.
a, b, c = (mesh.positions[mesh.triangles[:, i]].astype(float) for i in range(3))
volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
box = mesh.positions.max(axis=0) - mesh.positions.min(axis=0)
assert 0.4 < volume / box.prod() <= 1, volume / box.prod()
assert len(scene.balls(3).a) > 0
pixels, channels = scene.frame(3)
assert pixels.shape == (24, 32, len(channels)) and channels[:4] == ["R", "G", "B", "A"] and np.isfinite(pixels).all()
raises(2, "frames 1 to 6")(lambda: scene.mesh(7))
raises(3, "cuont")(lambda: polymorph.Scene({"source": "cube", "target": "sphere", "frames": {"cuont": 1}}))
# A dict and a changed setting; arrays outlive their scene; the same bits again.
again = polymorph.Scene("scene.json", set={"image.aovs": "none"})
assert np.array_equal(again.frame(3)[0], pixels[..., :4])
small = polymorph.Scene({"source": "cube", "target": "sphere"}, device="cpu",
                        set={"image.width": 16, "frames.count": 2, "surface.resolution": 16, "spheres.balls": 8})
assert small.size[0] == 16 and small.frame_count == 2
kept = polymorph.Scene("scene.json").mesh(3)
del again
assert np.array_equal(kept.positions, mesh.positions)

# The frames that the program wrote are the same, as half floats.
written = Exr("f.0003.exr")
for i, name in enumerate("RGBA"):
    rows = np.array(written.channels[name], dtype=np.float32)
    assert np.array_equal(pixels[..., i].astype(np.float16).astype(np.float32), rows), name
assert polymorph.identity() and (polymorph.data_folder() / "models/teapot.obj").is_file()
assert "properties" in polymorph.schema()
print("the Python module: ok")
