#!/usr/bin/env python3
"""What `polymorph mesh` writes, read by others: OpenUSD, trimesh, pygltflib and Blender as a module.

interop_test.py PROGRAM FOLDER    FOLDER keeps the virtual environment with the readers, which come from PyPI.
Exit code 77: they cannot be installed here. POLYMORPH_INTEROP_PYTHON names an interpreter that has them.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

READERS = ["usd-core==26.11", "trimesh", "pygltflib", "numpy", "scipy", "rtree", "pillow"]
BLENDER = ["bpy==5.0.1"]
ROOT = pathlib.Path(__file__).resolve().parent.parent


def skip(why):
    print(f"*** INTEROP TESTS SKIPPED: {why}", file=sys.stderr)
    sys.exit(77)


def set_up(folder):
    """An interpreter with the readers."""
    chosen = os.environ.get("POLYMORPH_INTEROP_PYTHON")
    if chosen:
        return chosen
    python = folder / "bin/python"
    if subprocess.run([python, "-c", "import pxr, trimesh, pygltflib"], capture_output=True).returncode if python.exists() else True:
        if subprocess.run([sys.executable, "-m", "venv", folder], capture_output=True).returncode:
            skip("python3 -m venv does not work here (python3-venv is not installed?)")
        done = subprocess.run([python, "-m", "pip", "install", "--quiet", *READERS], capture_output=True, text=True)
        if done.returncode:
            skip("pip cannot install the readers: " + done.stderr.strip().splitlines()[-1])
    if subprocess.run([python, "-c", "import bpy"], capture_output=True).returncode:
        if subprocess.run([python, "-m", "pip", "install", "--quiet", *BLENDER], capture_output=True).returncode:
            print("*** pip cannot install bpy: BLENDER IS NOT TESTED", file=sys.stderr)
    return python


if "--inside" not in sys.argv:
    program, environment = sys.argv[1], pathlib.Path(sys.argv[2])
    sys.exit(subprocess.run([set_up(environment), "-B", __file__, "--inside", program]).returncode)

import unittest  # noqa: E402

import numpy as np  # noqa: E402
import pygltflib  # noqa: E402
import trimesh  # noqa: E402
from pxr import Gf, Usd, UsdGeom, UsdShade  # noqa: E402
from scipy.spatial import cKDTree  # noqa: E402

PROGRAM = str(pathlib.Path(sys.argv.pop()).absolute())
sys.argv.remove("--inside")
FRAMES, MIDDLE = 6, 3
FIRST, LAST = 4, 6  # of the frames that one mesh is carried through
CARRIED = f"{FIRST}-{LAST}"
SCENE = {
    "source": str(ROOT / "scenes/models/penguin.obj"),
    "target": str(ROOT / "scenes/models/monkey.obj"),
    "frames": {"count": FRAMES, "fps": 12},
    "spheres": {"balls": 32},
    "surface": {"resolution": 32},
}


def sorted_points(points):
    points = np.ascontiguousarray(points, np.float32)
    return points[np.lexsort(points.T)]


class Glb:
    def __init__(self, path):
        self.file = pygltflib.GLTF2().load(str(path))
        self.bytes = self.file.binary_blob()

    def read(self, index):
        accessor = self.file.accessors[index]
        view = self.file.bufferViews[accessor.bufferView]
        kind = {5120: np.int8, 5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}[accessor.componentType]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor.type]
        stride = view.byteStride or width * np.dtype(kind).itemsize
        start = (view.byteOffset or 0) + (accessor.byteOffset or 0)
        rows = np.lib.stride_tricks.as_strided(
            np.frombuffer(self.bytes, kind, offset=start, count=1),
            (accessor.count, width), (stride, np.dtype(kind).itemsize))
        return rows.astype(np.float64) / np.iinfo(kind).max if accessor.normalized else rows.copy()


class Interop(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory(prefix="polymorph-interop-")
        cls.folder = pathlib.Path(cls.temporary.name)
        (cls.folder / "scene.json").write_text(json.dumps(SCENE))
        for output in (["m.usda"], ["m.glb"], ["q.glb", "--quantize"], ["m.ply"], ["o.obj"]):
            command = [PROGRAM, "mesh", "scene.json", "-q", "-o", *output]
            subprocess.run(command, cwd=cls.folder, check=True, stdout=subprocess.DEVNULL)
        smooth = SCENE | {"target": {"shape": "sphere", "spheres": {"balls": 8}}, "surface": {"resolution": 48}}
        (cls.folder / "smooth.json").write_text(json.dumps(smooth))
        for output in ("c.usda", "c.glb", "c.obj"):
            command = [PROGRAM, "mesh", "smooth.json", "-q", "--topology", "constant", "-f", CARRIED, "-o", output]
            subprocess.run(command, cwd=cls.folder, check=True, stdout=subprocess.DEVNULL)
        cls.stage = Usd.Stage.Open(str(cls.folder / "m.usda"))
        cls.mesh = UsdGeom.Mesh(cls.stage.GetPrimAtPath("/morph/penguin/surface"))

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def shown(self, frame):
        """The mesh that the frame shows: each look has one, and the others are invisible and empty."""
        meshes = [UsdGeom.Mesh(p) for p in self.stage.GetPrimAtPath("/morph/penguin").GetChildren()]
        visible = [m for m in meshes if m.ComputeVisibility(frame) == "inherited"]
        self.assertEqual(len(visible), 1)
        self.assertTrue(all(m in visible or not m.GetPointsAttr().Get(frame) for m in meshes))
        return visible[0]

    def points(self, frame):
        return np.array(self.shown(frame).GetPointsAttr().Get(frame), np.float32)

    def ply_data(self):
        """As trimesh parses it: what it makes a mesh of has its points split at the texture's seams."""
        return trimesh.load(self.folder / f"m.{MIDDLE:04}.ply", process=False).metadata["_ply_raw"]

    def test_usd_is_whole_at_every_frame(self):
        stage = self.stage
        self.assertEqual((stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()), (1, FRAMES, 12))
        self.assertEqual(UsdGeom.GetStageUpAxis(stage), "Y")
        self.assertEqual(UsdGeom.GetStageMetersPerUnit(stage), 1)
        for frame in range(1, FRAMES + 1):
            mesh = self.shown(frame)
            primvars = UsdGeom.PrimvarsAPI(mesh)
            self.assertEqual(mesh.GetSubdivisionSchemeAttr().Get(), "none")
            points, indices = mesh.GetPointsAttr().Get(frame), mesh.GetFaceVertexIndicesAttr().Get(frame)
            counts = mesh.GetFaceVertexCountsAttr().Get(frame)
            self.assertTrue(UsdGeom.Mesh.ValidateTopology(indices, counts, len(points))[0])
            corners = len(indices)
            normals = primvars.GetPrimvar("normals")  # where a frame's corners have their own
            if normals.HasValue():
                self.assertEqual(normals.GetInterpolation(), "faceVarying")
                flat = np.array(normals.ComputeFlattened(frame))
                self.assertEqual(len(flat), corners)
            else:
                self.assertEqual(mesh.GetNormalsInterpolation(), "vertex")
                flat = np.array(mesh.GetNormalsAttr().Get(frame))
                self.assertEqual(len(flat), len(points))
            self.assertLess(np.abs(np.linalg.norm(flat, axis=1) - 1).max(), 1e-4)
            self.assertEqual(len(mesh.GetVelocitiesAttr().Get(frame)), len(points))
            self.assertEqual(len(primvars.GetPrimvar("displayColor").Get(frame)), len(points))
            self.assertEqual(len(primvars.GetPrimvar("label").Get(frame)), len(points))
            self.assertEqual(len(primvars.GetPrimvar("st").ComputeFlattened(frame)), corners)
            low, high = mesh.GetExtentAttr().Get(frame)
            self.assertTrue(np.allclose(low, np.min(points, 0)) and np.allclose(high, np.max(points, 0)))
        primvars = UsdGeom.PrimvarsAPI(self.mesh)
        names = primvars.GetPrimvar("labelNames").Get()
        self.assertLess(max(primvars.GetPrimvar("label").Get(MIDDLE)), len(names))
        self.assertIn("beak", names)

    def test_usd_textures_and_camera(self):
        shader = UsdShade.Shader(self.stage.GetPrimAtPath("/morph/materials/penguin/texture"))
        asset = shader.GetInput("file").Get()
        self.assertTrue(pathlib.Path(asset.resolvedPath).is_file(), asset)
        # As a fresh resolver sees it, without the file's own folder as an anchor.
        self.assertEqual(asset.path, "./m.texture1.png")
        camera = UsdGeom.Camera(self.stage.GetPrimAtPath("/morph/camera")).GetCamera(1)
        box = Gf.Range3d(*(Gf.Vec3d(*map(float, f(self.points(1), 0))) for f in (np.min, np.max)))
        self.assertTrue(camera.frustum.Intersects(box.GetMidpoint()))
        # Each object has its own mesh, so that readers that take the assignment once show its texture.
        for frame, name in ((1, "penguin"), (FRAMES, "monkey")):
            bound = UsdShade.MaterialBindingAPI(self.shown(frame)).ComputeBoundMaterial()[0]
            self.assertEqual(bound.GetPrim().GetName(), name)

    def test_usd_velocities_end_on_the_next_surface(self):
        # At least from the first frame that moves to the last but one.
        for frame in range(2, FRAMES - 1):
            ends = self.points(frame) + np.array(self.shown(frame).GetVelocitiesAttr().Get(frame)) / 12
            faces = np.array(self.shown(frame + 1).GetFaceVertexIndicesAttr().Get(frame + 1)).reshape(-1, 3)
            following = trimesh.Trimesh(self.points(frame + 1), faces, process=False)
            distance = trimesh.proximity.closest_point(following, ends)[1]
            diagonal = np.linalg.norm(np.ptp(self.points(frame + 1), 0))
            self.assertLessEqual(np.sqrt(np.mean(distance**2)), 1e-3 * diagonal)

    def test_vertices_are_the_same_to_the_bit(self):
        usd, data = self.points(MIDDLE), self.ply_data()
        self.assertTrue(np.array_equal(np.stack([data["vertex"]["data"][k] for k in "xyz"], 1), usd))
        faces = np.array(self.mesh.GetFaceVertexIndicesAttr().Get(MIDDLE)).reshape(-1, 3)
        self.assertTrue(np.array_equal(data["face"]["data"]["vertex_indices"]["f1"], faces))
        self.assertTrue(trimesh.Trimesh(usd, faces, process=False).is_watertight)
        text = (self.folder / f"o.{MIDDLE:04}.obj").read_text().splitlines()
        obj = np.array([line.split()[1:4] for line in text if line.startswith("v ")]).astype(np.float32)
        self.assertTrue(np.array_equal(obj, usd))
        glb = Glb(self.folder / "m.glb")
        mesh = next(m for m in glb.file.meshes if m.name.endswith(f"{MIDDLE:04}"))
        points = glb.read(mesh.primitives[0].attributes.POSITION)
        self.assertTrue(np.array_equal(sorted_points(points), sorted_points(usd)))

    def test_ply_attributes_by_trimesh(self):
        data = self.ply_data()["vertex"]["data"]
        colors = np.array(UsdGeom.PrimvarsAPI(self.mesh).GetPrimvar("displayColor").Get(MIDDLE))
        encoded = np.where(colors <= 0.0031308, 12.92 * colors, 1.055 * np.clip(colors, 0, None) ** (1 / 2.4) - 0.055)
        own = np.stack([data[k] for k in ("red", "green", "blue")], 1)
        self.assertLessEqual(np.abs(own - 255 * np.clip(encoded, 0, 1)).max(), 1)
        velocities = np.stack([data[k] for k in ("vx", "vy", "vz")], 1)
        self.assertTrue(np.allclose(velocities, self.mesh.GetVelocitiesAttr().Get(MIDDLE), rtol=1e-4, atol=1e-5))
        self.assertTrue(np.array_equal(data["label"], UsdGeom.PrimvarsAPI(self.mesh).GetPrimvar("label").Get(MIDDLE)))

    def test_glb_shows_one_mesh_at_a_time(self):
        glb = Glb(self.folder / "m.glb")
        animation = glb.file.animations[0]
        scales = [c for c in animation.channels if c.target.path == "scale"]
        for frame in range(1, FRAMES + 1):
            shown = []
            for channel in scales:
                sampler = animation.samplers[channel.sampler]
                times = glb.read(sampler.input)[:, 0]
                at = np.searchsorted(times, (frame - 1) / 12 + 1e-3, side="right") - 1
                if glb.read(sampler.output)[at, 0] > 0:
                    shown.append(glb.file.nodes[channel.target.node].name)
            self.assertEqual(len(shown), 1, (frame, shown))
        for image in glb.file.images:
            view = glb.file.bufferViews[image.bufferView]
            self.assertEqual(glb.bytes[view.byteOffset : view.byteOffset + 4], b"\x89PNG")
        self.assertEqual(len(trimesh.load(self.folder / "m.glb", process=False).geometry), len(glb.file.meshes))

    def carried(self, frame):
        """Points and faces of a frame of the OBJ sequence of constant topology."""
        text = (self.folder / f"c.{frame:04}.obj").read_text().splitlines()
        points = np.array([line.split()[1:4] for line in text if line.startswith("v ")]).astype(np.float32)
        faces = np.array([[corner.split("/")[0] for corner in line.split()[1:]] for line in text if line.startswith("f ")])
        return points, faces.astype(int) - 1

    def test_morph_targets_are_the_frames(self):
        glb = Glb(self.folder / "c.glb")
        self.assertEqual(len(glb.file.meshes), 1)
        (primitive,) = glb.file.meshes[0].primitives
        self.assertEqual(len(primitive.targets), LAST - FIRST)
        base, indices = glb.read(primitive.attributes.POSITION), glb.read(primitive.indices)[:, 0]
        normals = glb.read(primitive.attributes.NORMAL)
        _, faces = self.carried(FIRST)
        for frame in range(FIRST, LAST + 1):
            points, same = self.carried(frame)
            self.assertTrue(np.array_equal(same, faces))
            target = primitive.targets[frame - FIRST - 1] if frame > FIRST else None
            moved = base + glb.read(target["POSITION"]) if target else base
            self.assertLess(np.abs(moved[indices] - points[faces.ravel()]).max(), 1e-5)
            turned = normals + glb.read(target["NORMAL"]) if target else normals
            self.assertLess(np.abs(np.linalg.norm(turned, axis=1) - 1).max(), 1e-4)
        animation = glb.file.animations[0]
        (channel,) = animation.channels
        self.assertEqual(channel.target.path, "weights")
        sampler = animation.samplers[channel.sampler]
        count = LAST - FIRST + 1
        self.assertTrue(np.allclose(glb.read(sampler.input)[:, 0], np.arange(count) / 12))
        weights = glb.read(sampler.output).reshape(count, count - 1)
        self.assertTrue(np.array_equal(weights, np.eye(count)[:, 1:]))
        self.assertEqual(len(trimesh.load(self.folder / "c.glb", process=False).geometry), 1)

    def test_usd_of_constant_topology_has_static_indices(self):
        stage = Usd.Stage.Open(str(self.folder / "c.usda"))  # a mesh does not keep its stage
        mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/morph/penguin/surface"))
        primvars = UsdGeom.PrimvarsAPI(mesh)
        constant = (mesh.GetFaceVertexIndicesAttr(), mesh.GetFaceVertexCountsAttr(), primvars.GetPrimvar("st").GetAttr())
        self.assertEqual([a.GetNumTimeSamples() for a in constant], [0, 0, 0])
        self.assertEqual(mesh.GetPointsAttr().GetNumTimeSamples(), LAST - FIRST + 1)
        for frame in range(FIRST, LAST + 1):
            points, faces = self.carried(frame)
            self.assertTrue(np.array_equal(np.array(mesh.GetPointsAttr().Get(frame), np.float32), points))
            self.assertTrue(np.array_equal(np.array(mesh.GetFaceVertexIndicesAttr().Get()), faces.ravel()))
            self.assertEqual(len(mesh.GetFaceVertexCountsAttr().Get()), len(faces))
            self.assertEqual(len(primvars.GetPrimvar("label").Get(frame)), len(points))
            # Velocities lead to the next frame's points.
            if frame < LAST:
                ends = points + np.array(mesh.GetVelocitiesAttr().Get(frame)) / 12
                self.assertLess(np.abs(ends - self.carried(frame + 1)[0]).max(), 1e-4)

    def test_quantized_glb_is_near(self):
        exact, rough = Glb(self.folder / "m.glb"), Glb(self.folder / "q.glb")
        pictures = sum(exact.file.bufferViews[i.bufferView].byteLength for i in exact.file.images)
        self.assertLess(len(rough.bytes) - pictures, 0.6 * (len(exact.bytes) - pictures))
        for node in range(len(exact.file.meshes)):
            a, b = exact.file.nodes[node], rough.file.nodes[node]
            sampler = rough.file.animations[0].samplers[2 * node]
            scale = rough.read(sampler.output)[:, 0].max()
            for one, other in zip(exact.file.meshes[a.mesh].primitives, rough.file.meshes[b.mesh].primitives):
                points = exact.read(one.attributes.POSITION).astype(float)
                near = rough.read(other.attributes.POSITION) * scale + b.translation
                self.assertLessEqual(np.abs(points - near).max(), 0.51 * scale / 65535 + 1e-6)
                normals, turned = exact.read(one.attributes.NORMAL), rough.read(other.attributes.NORMAL)
                self.assertLessEqual(np.abs(normals - turned).max(), 0.51 / 127)

    def test_blender_imports_all(self):
        try:
            import bpy
        except ImportError:
            self.skipTest("bpy is not installed: BLENDER IS NOT TESTED")
        wanted = sorted_points(self.points(MIDDLE))

        def imported(importer, name, frame=None):
            bpy.ops.wm.read_factory_settings(use_empty=True)
            importer(filepath=str(self.folder / name))
            if frame:
                bpy.context.scene.frame_set(frame)
            graph = bpy.context.evaluated_depsgraph_get()
            return {o.name: o.evaluated_get(graph).to_mesh() for o in bpy.data.objects if o.type == "MESH"}

        def points(mesh):
            flat = np.empty(3 * len(mesh.vertices), np.float32)
            mesh.vertices.foreach_get("co", flat)
            return sorted_points(flat.reshape(-1, 3))

        usd = imported(bpy.ops.wm.usd_import, "m.usda", MIDDLE)["surface"]
        self.assertTrue(np.array_equal(points(usd), wanted))
        for attribute in ("velocity", "displayColor", "st", "label"):
            self.assertIn(attribute, usd.attributes)
        ply = imported(lambda filepath: bpy.ops.wm.ply_import(filepath=filepath), f"m.{MIDDLE:04}.ply")
        self.assertTrue(np.array_equal(points(next(iter(ply.values()))), wanted))
        obj = imported(lambda filepath: bpy.ops.wm.obj_import(filepath=filepath), f"o.{MIDDLE:04}.obj")
        self.assertTrue(np.array_equal(points(next(iter(obj.values()))), wanted))
        glb = imported(bpy.ops.import_scene.gltf, "m.glb")[f"penguin.{MIDDLE:04}"]
        # Blender's z is up: (x, y, z) becomes (x, -z, y).
        upright = np.array(points(glb))
        self.assertTrue(np.array_equal(sorted_points(np.stack([upright[:, 0], upright[:, 2], -upright[:, 1]], 1)), wanted))
        # Morph targets are shape keys, the first of them the first frame.
        imported(bpy.ops.import_scene.gltf, "c.glb")
        (carried,) = [o for o in bpy.data.objects if o.type == "MESH"]
        keys = carried.data.shape_keys.key_blocks
        self.assertEqual(len(keys), LAST - FIRST + 1)
        for frame, key in zip(range(FIRST, LAST + 1), keys):
            at = np.array([(p.co.x, p.co.z, -p.co.y) for p in key.data], np.float32)
            points_then, _ = self.carried(frame)
            self.assertLess(cKDTree(points_then).query(at)[0].max(), 1e-5)
            self.assertLess(cKDTree(at).query(points_then)[0].max(), 1e-5)


if __name__ == "__main__":
    unittest.main()
