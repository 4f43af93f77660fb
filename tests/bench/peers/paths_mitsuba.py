#!/usr/bin/env python3
"""paths_mitsuba.py [PICTURE]: paths a second of Mitsuba 3's path integrator on a GPU, beside `polymorph bench render --device cuda`.

Needs Mitsuba and Dr.Jit from PyPI (3.9.1 and 1.5.0 were measured), numpy, and a driver with OptiX; run both programs by turns on one
machine. The scene is the bench's in kind: a torus of 101 104 triangles on a floor under a sky and a sun, 640 x 480 pixels, paths of at
most four bounces, to pixels in the host's memory. Mitsuba's hierarchy is built before, and its time stands in a line of its own;
polymorph's time includes its own.
"""
import pathlib
import sys
import tempfile
import time

import mitsuba as mi

mi.set_variant("cuda_ad_rgb")
import drjit as dr  # noqa: E402 (after the variant)
import numpy as np  # noqa: E402

WIDTH, HEIGHT, WARM_UP, REPEATS = 640, 480, 3, 9


def write_torus(path, columns=356, rows=142):
    """A torus of radii 1 and 0.4 around the y axis."""
    u, v = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    a, b = 2 * np.pi * u / columns, 2 * np.pi * v / rows
    radius = 1 + 0.4 * np.cos(b)
    points = np.stack([radius * np.cos(a), 0.4 * np.sin(b), radius * np.sin(a)], -1).reshape(-1, 3)
    at = lambda i, j: (u + i) % columns * rows + (v + j) % rows  # noqa: E731
    faces = np.concatenate([np.stack(corners, -1).reshape(-1, 3) for corners in ((at(0, 0), at(1, 1), at(1, 0)), (at(0, 0), at(0, 1), at(1, 1)))])
    mesh = mi.Mesh("torus", len(points), len(faces))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = points.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    mesh.write_ply(str(path))


def load(torus):
    transform = mi.ScalarTransform4f
    return mi.load_dict({
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 5, "rr_depth": 100},
        "sensor": {"type": "perspective", "fov": 30, "fov_axis": "y",
                   "to_world": transform().look_at(origin=[2.6, 2.4, 4.4], target=[0, 0, 0], up=[0, 1, 0]),
                   "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "gaussian"}, "pixel_format": "rgba"},
                   "sampler": {"type": "independent"}},
        "torus": {"type": "ply", "filename": str(torus), "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.6, 0.5, 0.4]}}},
        "floor": {"type": "rectangle", "to_world": transform().translate([0, -0.4, 0]).rotate([1, 0, 0], -90).scale(20), "bsdf": {"type": "diffuse"}},
        "sky": {"type": "constant", "radiance": 0.5},
        "sun": {"type": "directional", "direction": [-0.5, -1, -0.4], "irradiance": 2.0},
    })


def main():
    with tempfile.TemporaryDirectory() as folder:
        torus = pathlib.Path(folder) / "torus.ply"
        write_torus(torus)
        load(torus)
        begun = time.perf_counter()
        scene = load(torus)
        dr.sync_thread()
        print(f"mitsuba {mi.__version__}: scene and hierarchy {1e3 * (time.perf_counter() - begun):.1f} ms")
        for samples in (16, 64):
            seconds = []
            for seed in range(WARM_UP + REPEATS):
                begun = time.perf_counter()
                image = mi.render(scene, spp=samples, seed=seed)
                np.array(image)  # in the host's memory
                seconds.append(time.perf_counter() - begun)
            median = sorted(seconds[WARM_UP:])[REPEATS // 2]
            print(f"{samples} samples: {1e3 * median:.1f} ms, {1e-6 * WIDTH * HEIGHT * samples / median:.0f} M paths/s (the first {1e3 * seconds[0]:.0f} ms)")
        if len(sys.argv) > 1:
            mi.util.write_bitmap(sys.argv[1], image)


if __name__ == "__main__":
    main()
