"""Sizes and colours of all pictures; functions that draw sheets of renders, outlines and shaded meshes."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.collections import PolyCollection  # noqa: E402

REPORT = "#c4572e"  # colour of the report's method
OURS = "#1f6f9f"
GREEN, GREY, LIGHT, INK = "#3c8d4f", "#8a8f94", "#dfe3e6", "#22262a"
LEVELS = ["#7b3f98", "#1f6f9f", "#3c8d4f", "#d9a22b", "#c4572e", "#8a8f94"]
DPI = 100

plt.rcParams.update(
    {
        "font.family": "DejaVu Sans",
        "font.size": 10,
        "axes.titlesize": 10.5,
        "axes.labelsize": 10,
        "axes.edgecolor": GREY,
        "axes.labelcolor": INK,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": False,
        "grid.color": LIGHT,
        "text.color": INK,
        "xtick.color": INK,
        "ytick.color": INK,
        "legend.frameon": False,
        "legend.fontsize": 9,
        "lines.linewidth": 1.6,
        "figure.constrained_layout.h_pad": 0.09,
        "figure.dpi": DPI,
        "savefig.dpi": 2 * DPI,
        "svg.hashsalt": "polymorph",  # makes the bytes reproducible
    }
)


def panels(columns, rows=1, width=900, height=300, **options):
    """Returns a figure of width x height pixels, and its columns x rows Axes as a flat list."""
    fig, axes = plt.subplots(rows, columns, figsize=(width / DPI, height / DPI), layout="constrained", **options)
    return fig, list(np.ravel(axes))


def plain(ax, title="", color=INK):
    """Hides the axes, sets equal scales and a title."""
    ax.set_aspect("equal")
    ax.axis("off")
    ax.set_title(title, color=color)
    return ax


def outline(ax, points, **style):
    points = np.vstack([points, points[:1]])
    ax.plot(points[:, 0], points[:, 1], **{"color": INK, "lw": 1.4, **style})


def circles(ax, centers, radii, **style):
    for (x, y), r in zip(centers, radii):
        ax.add_patch(plt.Circle((x, y), r, **{"fill": False, "lw": 0.8, "ec": OURS, **style}))


def view(azimuth, elevation):
    """Returns the view matrix of a scene's camera at these angles in degrees: rows right, up (y), toward the eye."""
    a, e = np.radians(azimuth), np.radians(elevation)
    right = [np.cos(a), 0, -np.sin(a)]
    toward = [np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)]
    return np.array([right, np.cross(toward, right), toward])


def solid(ax, points, triangles, camera, color=LIGHT, edge="none", alpha=1.0, light=(0.3, 0.7, 0.65), lw=0.4):
    """Draws a shaded mesh, far faces first. A mesh of more than 1000 triangles is rasterized in SVG files."""
    in_view = points @ camera.T
    corners = in_view[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
    front = normal[:, 2] > 0
    corners, normal = corners[front], normal[front]
    order = corners[:, :, 2].mean(axis=1).argsort()
    shade = 0.55 + 0.45 * np.clip(normal[order] @ (np.array(light) / np.linalg.norm(light)), 0, 1)
    rgb = np.array(matplotlib.colors.to_rgb(color))
    faces = np.clip(rgb[None] * shade[:, None], 0, 1)
    ax.add_collection(
        PolyCollection(
            corners[order][:, :, :2],
            facecolors=faces,
            edgecolors=faces if edge == "none" else edge,
            linewidths=0.2 if edge == "none" else lw,
            alpha=alpha,
            rasterized=len(triangles) > 1000,
        )
    )
    ax.autoscale_view()


# Bit k of a corner's number is its coordinate k.
BOX_EDGES = [(a, a | 1 << k) for a in range(8) for k in range(3) if not a >> k & 1]
BOX_CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], float)


def box(ax, low, side, camera, **style):
    """Draws the edges of a cube."""
    corners = (np.asarray(low) + side * BOX_CORNERS) @ camera.T
    for a, b in BOX_EDGES:
        ax.plot(corners[[a, b], 0], corners[[a, b], 1], **{"color": GREY, "lw": 0.7, **style})


def sheet(rows, labels, heads=(), gap=6, scale=1):
    """Returns a figure of renders in rows, in their own pixels, with labels above rows and heads above columns. None is an empty cell."""
    height, width = rows[0][0].shape[:2]
    heights = [next(picture for picture in row if picture is not None).shape[0] for row in rows]
    columns = max(len(row) for row in rows)
    label_height, head_height = 26, 24 if heads else 4  # pixels
    total_w = columns * (width + gap) - gap
    total_h = head_height + sum((label_height if label else 0) + height + gap for height, label in zip(heights, labels))
    fig = plt.figure(figsize=(total_w / DPI, total_h / DPI), dpi=DPI)
    fig.pixel_exact = True
    for i, text in enumerate(heads):
        fig.text((i * (width + gap) + width / 2) / total_w, 1 - 16 / total_h, text, ha="center", va="center")
    top = head_height
    for row, height, label in zip(rows, heights, labels):
        if label:
            color = REPORT if label.startswith("The report's method") else OURS if label.startswith("Ours") else INK
            fig.text(2 / total_w, 1 - (top + 15) / total_h, label, va="center", weight="bold", color=color)
            top += label_height
        for i, picture in enumerate(row):
            if picture is None:
                continue
            h, w = picture.shape[:2]
            ax = fig.add_axes([i * (width + gap) / total_w, 1 - (top + h) / total_h, w / total_w, h / total_h])
            ax.imshow(picture, interpolation="nearest", aspect="auto")
            ax.axis("off")
        top += height + gap
    return fig
