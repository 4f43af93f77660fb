"""Chapter 2: normals, the medial axis, and projection onto a circle."""

import json

import matplotlib.tri
import numpy as np
from matplotlib.collections import LineCollection

from . import draw, geometry
from .registry import figure
from .work import models_only_settings


def obj_with_normals(points, triangles, normals):
    """Returns the OBJ text of a mesh with normals (n, 3, 3), one per corner of each triangle."""
    lines = ["v %.6f %.6f %.6f" % tuple(p) for p in points]
    lines += ["vn %.6f %.6f %.6f" % tuple(n) for n in normals.reshape(-1, 3)]
    for i, t in enumerate(triangles):
        lines.append("f " + " ".join(f"{v + 1}//{3 * i + k + 1}" for k, v in enumerate(t)))
    return "\n".join(lines) + "\n"


@figure(
    "fig2.1",
    "Face normals against vertex normals",
    "An icosphere with face normals (blue) looks angular, with vertex normals (red), the mean of the faces around, "
    "smooth. Its volumetric surfaces have face normals only, which it regrets (6.2, 7.3).",
)
def fig2_1(w):
    points, triangles = geometry.icosphere(1)
    corners = points[triangles]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    vertex = np.zeros_like(points)
    for k in range(3):
        np.add.at(vertex, triangles[:, k], face)
    vertex /= np.linalg.norm(vertex, axis=1, keepdims=True)

    camera = draw.view(28, 16)
    fig, axes = draw.panels(4, width=1040, height=290)
    for ax, starts, arrows, color, title in (
        (axes[0], corners.mean(axis=1), face, "#2357c6", "face normals"),
        (axes[2], points, vertex, "#c62828", "vertex normals"),
    ):
        draw.plain(ax, title, color)
        draw.solid(ax, points, triangles, camera, color="#eef0f2", edge=draw.GREY)
        in_view = arrows @ camera.T
        front = in_view[:, 2] > -0.05
        a, b = (starts @ camera.T)[front], ((starts + 0.3 * arrows) @ camera.T)[front]
        ax.add_collection(LineCollection(np.stack([a[:, :2], b[:, :2]], axis=1), colors=color, linewidths=1.3))
        ax.set(xlim=(-1.35, 1.35), ylim=(-1.35, 1.35))
    for ax, normals in ((axes[1], np.repeat(face[:, None], 3, axis=1)), (axes[3], vertex[triangles])):
        path = w.file(".obj")
        path.write_text(obj_with_normals(points, triangles, normals))
        scene = w.scene([{"model": path, "color": [0.45, 0.5, 0.55]}, {"shape": "sphere"}], models_only_settings())
        [image] = w.render(scene, [1], 240, 240, samples=64)
        ax.imshow(image)
        draw.plain(ax, "as polymorph renders it")
    w.picture(fig)

    # Angle between the normals of the two triangles at each edge.
    neighbours = {}
    for i, t in enumerate(triangles):
        for k in range(3):
            neighbours.setdefault(tuple(sorted((t[k], t[(k + 1) % 3]))), []).append(i)
    jumps = [np.degrees(np.arccos(np.clip(face[i] @ face[j], -1, 1))) for i, j in neighbours.values()]
    rows = [["face", len(triangles), float(np.mean(jumps))], ["vertex", len(points), 0.0]]
    w.table(["normals", "how many", "mean jump of the normal across an edge (degrees)"], rows)
    w.say(
        f"The same {len(triangles)} triangles, rendered with both: face normals jump by {rows[0][2]:.1f} degrees from a"
        " triangle to the next, vertex normals by none.",
        "polymorph's extracted surfaces have a normal at each vertex, the gradient of the field there; a model without "
        "normals gets the weighted mean of its faces up to a crease of 50 degrees, so that edges stay edges. "
        "`report.flat` brings the report's face normals back.",
    )


# An outline with arms of different widths, counter-clockwise.
OUTLINE = np.array(
    [[0.1, 0], [1.15, 0], [1.25, 0.75], [2.3, 0.85], [2.45, 1.55], [1.3, 1.6], [1.05, 2.4], [0.35, 2.3], [0, 1.1]]
)


def circumcircle(a, b, c):
    """Returns centre and radius of the circle through three points; far away if these lie on a line."""
    d = 2 * (a[0] * (b[1] - c[1]) + b[0] * (c[1] - a[1]) + c[0] * (a[1] - b[1]))
    d = d if abs(d) > 1e-9 else 1e-9
    aa, bb, cc = a @ a, b @ b, c @ c
    x = (aa * (b[1] - c[1]) + bb * (c[1] - a[1]) + cc * (a[1] - b[1])) / d
    y = (aa * (c[0] - b[0]) + bb * (a[0] - c[0]) + cc * (b[0] - a[0])) / d
    return np.array([x, y]), float(np.hypot(x - a[0], y - a[1]))


@figure(
    "fig2.2",
    "Voronoi diagram, medial axis and circles",
    "(a) source polygon, (b) points at even distances along it, (c) their Voronoi diagram, whose inner part is the"
    " medial axis, (d) a circle at each inner Voronoi vertex through its forming points. Hubbard's method was"
    " explained, not built.",
)
def fig2_2(w):
    samples = geometry.sample_outline(OUTLINE, 72)
    delaunay = matplotlib.tri.Triangulation(*samples.T)
    circles = [circumcircle(*samples[t]) for t in delaunay.triangles]
    centers, radii = np.array([c for c, _ in circles]), np.array([r for _, r in circles])
    within = geometry.inside(OUTLINE, centers)
    pairs = [(i, j) for i, row in enumerate(delaunay.neighbors) for j in row if j > i]

    fig, axes = draw.panels(6, width=1260, height=270)
    titles = ["(a) polygon", f"(b) {len(samples)} points", "(c) Voronoi, medial axis", f"(d) {within.sum()} circles"]
    for ax, title in zip(axes, titles):
        draw.plain(ax, title)
        draw.outline(ax, OUTLINE, lw=1.4 if ax is axes[0] else 0.9)
        ax.set(xlim=(-0.25, 2.7), ylim=(-0.25, 2.65))
    for ax in axes[1:3]:
        ax.plot(*samples.T, ".", color=draw.REPORT, ms=4)
    for is_inside, color, width in ((False, draw.LIGHT, 0.8), (True, draw.INK, 1.5)):
        lines = [centers[[i, j]] for i, j in pairs if (within[i] and within[j]) == is_inside]
        axes[2].add_collection(LineCollection(lines, colors=color, linewidths=width, clip_on=True))
    draw.circles(axes[3], centers[within], radii[within], ec=draw.REPORT, lw=0.6)

    # Ours: the outline as a thick prism; its balls cut the plane z = 0 in circles.
    prism = w.file(".obj")
    prism.write_text(geometry.prism_obj(OUTLINE, 2.0))
    rows = [["circles of (d), in the plane", int(within.sum()), None]]
    for ax, method, title in ((axes[4], "hubbard", "Hubbard, merged"), (axes[5], "medial", "medial cover")):
        tree = w.file(".json")
        options = ["--method", method, "--balls", 64, "--no-fit", "--grid", 48, "--write-spheres", tree]
        report, _ = w.spheres(prism, *options)
        leaves = [s for s in json.loads(tree.read_text())["spheres"] if s["leaf"]]
        sections = [(s["center"][:2], s["radius"] ** 2 - s["center"][2] ** 2) for s in leaves]
        sections = [(c, r2**0.5) for c, r2 in sections if r2 > 0]
        draw.plain(ax, f"Ours: {title}", draw.OURS)
        draw.outline(ax, OUTLINE, lw=0.9)
        draw.circles(ax, [c for c, _ in sections], [r for _, r in sections], lw=0.9)
        ax.set(xlim=(-0.25, 2.7), ylim=(-0.25, 2.65))
        rows.append([f"balls of the prism, {method}", report["spheres"], report["iou"]])
    w.picture(fig)
    w.table(["what", "how many", "IoU of their metaballs' surface"], rows, show=False)
    w.say(
        f"(a) to (d) computed the same way; then what the program makes of a prism of that outline with {rows[1][1]}"
        " balls, cut in the middle: `hubbard` merges the Voronoi balls down to the wanted number, `medial` picks those"
        " that cover most.",
        "Hubbard's method is built here, in space, and can be chosen; the default picks medial balls instead of merging"
        " them, because a merged ball must stand out of the model and a picked one does not.",
    )


STAR = np.array([[0.0, 1.35], [-0.42, 0.45], [-1.3, 0.55], [-0.6, -0.2], [-0.95, -1.15], [0.0, -0.55], [0.9, -1.2]])
STAR = np.vstack([STAR, [[0.6, -0.15], [1.3, 0.5], [0.4, 0.45]]])
# A hook: no point sees all of it, so it is no star polygon.
HOOK = np.array([[-1.1, -1.1], [1.1, -1.1], [1.1, 1.1], [-0.5, 1.1], [-0.5, 0.2], [0.1, 0.2], [0.1, 0.55]])
HOOK = np.vstack([HOOK, [[0.6, 0.55], [0.6, -0.6], [-1.1, -0.6]]])


@figure(
    "fig2.3",
    "Star and non-star polygons projected onto a circle",
    "Pushed out from a centre, the vertices of a star polygon keep their order; those of a non-star polygon pass each"
    " other, and edges collide (red). Boundary morphs through a sphere fail there.",
)
def fig2_3(w):
    fig, axes = draw.panels(2, width=760, height=370)
    rows, strips = [], []
    for ax, shape, center, name in ((axes[0], STAR, (0, 0), "star"), (axes[1], HOOK, (0.85, 0), "non-star")):
        angles = np.unwrap(np.arctan2(*(shape - center).T[::-1]))
        is_backward = np.diff(np.append(angles, angles[0] + 2 * np.pi)) < 0
        on_circle = 1.75 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        for i, p in enumerate(shape):
            ax.plot(*zip(p, on_circle[i]), color=draw.LIGHT, lw=0.9, zorder=0)
            # The edge as an arc on the circle, red if it runs backwards over its neighbours.
            sweep = np.linspace(
                angles[i], angles[(i + 1) % len(shape)] + (2 * np.pi if i + 1 == len(shape) else 0), 200
            )
            radius = 1.83 if is_backward[i] else 1.75
            color, width = ("#d32222", 2.6) if is_backward[i] else (draw.OURS, 1.6)
            ax.plot(radius * np.cos(sweep), radius * np.sin(sweep), color=color, lw=width)
        draw.plain(ax, f"{name} polygon: {is_backward.sum()} of {len(shape)} edges run backwards")
        draw.outline(ax, shape)
        ax.plot(*on_circle.T, "o", color=draw.OURS, ms=4)
        ax.plot(*center, "+", color=draw.INK)
        rows.append([name, len(shape), int(is_backward.sum())])
        prism = w.file(".obj")
        prism.write_text(geometry.prism_obj(shape, 0.7))
        scene = w.scene(
            [
                {"model": prism, "name": name, "color": [0.12, 0.36, 0.52]},
                {"shape": "sphere", "color": [0.12, 0.36, 0.52]},
            ],
            {
                "spheres": {"balls": 96},
                "frames": {"count": 24},
                "camera": {"azimuth": 15, "elevation": 8},
                **w.coarse(),
            },
        )
        strips.append(w.render(scene, [1, 7, 10, 13, 16, 24], 160, 150))
    w.picture(fig)
    w.table(["polygon", "vertices", "edges that run backwards"], rows, show=False)
    w.picture(draw.sheet(strips, ["Ours: star prism to sphere", "Ours: non-star prism to sphere"]), part="ours")
    w.say(
        f"The construction again: {rows[0][2]} colliding edges for the star, {rows[1][2]} for the other. Below, the "
        "program takes prisms of both to a sphere.",
        "Balls have no edges that could collide, so a non-star body needs nothing special: the report's reason for "
        "metaballs, and still ours.",
    )
