#!/usr/bin/env python3
"""paths_cycles.py [DEVICE [FOLDER]]: paths a second of Blender's Cycles, beside `polymorph bench render --device cuda`.

DEVICE is CUDA (default), OPTIX or CPU. Needs the module bpy of PyPI (5.0.1 was measured, for Python 3.11) with its numpy; run both
programs by turns on one machine. The scene is the bench's in kind and that of paths_mitsuba.py: a torus of 101 104 triangles on a floor
under a sky and a sun, 640 x 480 pixels, paths of at most four bounces, without adaptive samples and without a denoiser. Data are
persistent, so that the hierarchy is built once, before; each time is that of a whole render, to a picture in a file of FOLDER
(default: one in memory). The last line is the rate without what a render costs at no sample: between 64 and 1024 samples. With FOLDER,
pictures of 1 to 256 samples and one of 8192 are left there, for `polymorph compare`.
"""
import contextlib
import os
import pathlib
import sys
import tempfile
import time

import bpy
import numpy as np

WIDTH, HEIGHT, WARM_UP, REPEATS = 640, 480, 2, 7


def torus(columns=356, rows=142):
    """A torus of radii 1 and 0.4 around the z axis."""
    u, v = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    a, b = 2 * np.pi * u / columns, 2 * np.pi * v / rows
    radius = 1 + 0.4 * np.cos(b)
    points = np.stack([radius * np.cos(a), radius * np.sin(a), 0.4 * np.sin(b)], -1).reshape(-1, 3)
    at = lambda i, j: (u + i) % columns * rows + (v + j) % rows  # noqa: E731
    faces = np.concatenate([np.stack(corners, -1).reshape(-1, 3) for corners in ((at(0, 0), at(1, 0), at(1, 1)), (at(0, 0), at(1, 1), at(0, 1)))])
    mesh = bpy.data.meshes.new("torus")
    mesh.from_pydata(points.tolist(), [], faces.tolist())
    mesh.shade_smooth()
    return mesh


def diffuse(name, color):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    shader, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (*color, 1)
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def make_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene

    def add(name, data, location=(0, 0, 0)):
        thing = bpy.data.objects.new(name, data)
        thing.location = location
        scene.collection.objects.link(thing)
        return thing

    mesh = torus()
    mesh.materials.append(diffuse("torus", (0.6, 0.5, 0.4)))
    add("torus", mesh)
    floor = bpy.data.meshes.new("floor")
    floor.from_pydata([(-20, -20, 0), (20, -20, 0), (20, 20, 0), (-20, 20, 0)], [], [(0, 1, 2, 3)])
    floor.materials.append(diffuse("floor", (0.5, 0.5, 0.5)))
    add("floor", floor, (0, 0, -0.4))
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy = 2
    add("sun", sun).rotation_euler = (0.5, 0.4, 0)
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes.get("Background") or scene.world.node_tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle = "VERTICAL", np.radians(30)
    eye = add("camera", camera, (2.6, -4.4, 2.4))
    target = add("target", None)
    look = eye.constraints.new("TRACK_TO")
    look.target, look.track_axis, look.up_axis = target, "TRACK_NEGATIVE_Z", "UP_Y"
    scene.camera = eye
    return scene


def choose_device(scene, device):
    scene.render.engine = "CYCLES"
    if device == "CPU":
        scene.cycles.device = "CPU"
        return
    preferences = bpy.context.preferences.addons["cycles"].preferences
    preferences.compute_device_type = device
    preferences.refresh_devices()
    for one in preferences.devices:
        one.use = one.type == device
    if not any(one.use for one in preferences.devices):
        sys.exit(f"no device of the kind {device}")
    print("device:", ", ".join(one.name for one in preferences.devices if one.use))
    scene.cycles.device = "GPU"


@contextlib.contextmanager
def silence():
    """Sends what the program itself prints to nowhere."""
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)


def render(scene, samples, seed, path):
    scene.cycles.samples, scene.cycles.seed = samples, seed
    scene.render.filepath = str(path)
    begun = time.perf_counter()
    with silence():
        bpy.ops.render.render(write_still=True)
    return time.perf_counter() - begun


def main():
    device = sys.argv[1] if len(sys.argv) > 1 else "CUDA"
    scene = make_scene()
    choose_device(scene, device)
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = WIDTH, HEIGHT, 100
    scene.render.use_persistent_data = True
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.exr_codec = "NONE"
    cycles = scene.cycles
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = 4
    cycles.use_auto_tile = False
    with tempfile.TemporaryDirectory(dir="/dev/shm") as memory:
        folder = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else memory)
        print(f"bpy {bpy.app.version_string}: first render, with kernels and hierarchy {render(scene, 1, 0, folder / 'first.exr'):.1f} s", flush=True)
        medians = {}
        for samples in (1, 4, 16, 64, 128, 256, 1024):
            seconds = sorted(render(scene, samples, seed, folder / f"samples{samples}.exr") for seed in range(WARM_UP + REPEATS))
            medians[samples] = seconds[(WARM_UP + REPEATS) // 2]
            print(f"{samples} samples: {1e3 * medians[samples]:.1f} ms, {1e-6 * WIDTH * HEIGHT * samples / medians[samples]:.1f} M paths/s", flush=True)
        rate = WIDTH * HEIGHT * (1024 - 64) / (medians[1024] - medians[64])
        print(f"without what a render costs at no sample: {1e-6 * rate:.1f} M paths/s", flush=True)
        if len(sys.argv) > 2:
            render(scene, 8192, 99, folder / "samples8192.exr")


if __name__ == "__main__":
    main()
