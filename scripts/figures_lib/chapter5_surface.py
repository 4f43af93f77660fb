"""Chapter 5, second half: voxel keys, cubes, blob constants, resolutions, filtering, looks and stages."""

import json

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from . import draw, geometry
from .registry import figure
from .work import REPORT_SCENE

CUBE_VIEW = draw.view(22, 18)


def cube(ax, table, key, labels=False):
    """Draws a marching cube of the program's table."""
    corners = np.array([c["at"] for c in table["corners"]], float)
    middle = {e: corners[list(ends)].mean(axis=0) for e, ends in enumerate(table["edges"])}
    seen = corners @ CUBE_VIEW.T
    hidden = seen[:, 2].argmin()
    for a, b in table["edges"]:
        style = {"color": draw.LIGHT, "lw": 1} if hidden in (a, b) else {"color": draw.GREY, "lw": 1}
        ax.plot(seen[[a, b], 0], seen[[a, b], 1], zorder=1, **style)
    case = table["cubes"][key]
    triangles = [np.array([middle[e] for e in t]) @ CUBE_VIEW.T for t in case["triangles"]]
    for t in sorted(triangles, key=lambda t: t[:, 2].mean()):
        n = np.cross(t[1] - t[0], t[2] - t[0])
        shade = 0.75 + 0.25 * abs(n @ [0.3, 0.6, 0.74]) / np.linalg.norm(n)
        color = np.array([0.35, 0.62, 0.80] if n[2] > 0 else [0.85, 0.66, 0.52]) * shade
        ax.fill(t[:, 0], t[:, 1], fc=color, ec="white", lw=0.8, alpha=0.92, zorder=2)
    for i, p in enumerate(seen):
        inside = i in case["inside"]
        ax.plot(*p[:2], "o", ms=6, color=draw.INK if inside else "white", mec=draw.INK, mew=0.9, zorder=3)
        if labels:
            side = np.where(p[:2] > seen.mean(axis=0)[:2], 1, -1)
            text = f"V{i + 1} = {table['corners'][i]['weight']}"
            label_style = {"xytext": (10 * side[0], 11 * side[1]), "textcoords": "offset points", "va": "center"}
            ax.annotate(text, p[:2], ha="left" if side[0] > 0 else "right", fontsize=9, zorder=4, **label_style)
    span = 1.2 if labels else 0.9
    center = seen.mean(axis=0)
    ax.set(xlim=(center[0] - span, center[0] + span), ylim=(center[1] - span, center[1] + span))


@figure(
    "fig5.6",
    "Voxel key assignments",
    "V1 to V8 weigh 128, 64, 32, 16, 8, 4, 2 and 1; the key is the sum over the corners above the threshold. Its"
    " example: 11110000 is key 240 (Fig. 5.12).",
)
def fig5_6(w):
    table = json.loads(w.run("cubes", "--json"))
    fig, axes = draw.panels(3, width=1000, height=320)
    for ax, key in zip(axes, (0, 240, 0b10010110)):
        draw.plain(ax, f"key {key} = {key:08b}" if key else "weights")
        cube(ax, table, key, labels=not key)
    w.picture(fig)
    w.table(
        ["corner", "x", "y", "z", "weight"],
        [[f"V{i + 1}", *c["at"], c["weight"]] for i, c in enumerate(table["corners"])],
    )
    weights = ", ".join(str(c["weight"]) for c in table["corners"])
    count = len(table["cubes"][240]["triangles"])
    w.say(
        f"The weights {weights}, from `polymorph cubes`; key 240 has four corners of one face inside and {count}"
        " triangles.",
        "The key is the same. Which corner of a cell is V1 is this program's choice (x fastest), as the report's"
        " drawing is lost in the text we have. Its Algorithm 5.2 assigns where it must add; here the weights are"
        " summed.",
    )


@figure(
    "fig5.7",
    "The 15 base cubes",
    "15 base cubes; all 256 combinations are created by rotational and mirror symmetry when the program starts.",
)
def fig5_7(w):
    table = json.loads(w.run("cubes", "--json"))
    fig, axes = draw.panels(5, 3, width=1000, height=660)
    rows = []
    for base, (ax, key) in enumerate(zip(axes, table["bases"])):
        members = [c for c in table["cubes"] if c["base"] == base]
        draw.plain(ax, f"{base + 1}: key {key}, {len(members)} of 256")
        cube(ax, table, key)
        rows.append([base + 1, key, len(table["cubes"][key]["triangles"]), len(members)])
    fig.suptitle("blue: seen from outside, sand: from inside; black corners are inside", fontsize=9, color=draw.GREY)
    w.picture(fig)
    w.table(["base cube", "key", "triangles", "keys made from it"], rows, show=False)
    other_counts = sum(
        len(c["triangles"]) != len(table["cubes"][table["bases"][c["base"]]]["triangles"]) for c in table["cubes"]
    )
    w.say(
        f"{len(rows)} base cubes, from which the program makes {sum(r[3] for r in rows)} keys.",
        "Made by rotation and complement, without mirrors: base cubes 12 and 15 are each other's mirror images."
        f" {other_counts} keys have another number of triangles than their base: complements with an ambiguous face get their"
        " own, or neighbouring cells would leave holes between them.",
    )


@figure(
    "fig5.8",
    "Three blob constants",
    "Low: the ears do not appear to be attached. Medium: all features attached. High: detail suffers, not recognisable."
    " The constants are not given.",
    models=("suzanne", "torus"),
    scenes=(REPORT_SCENE,),
)
def fig5_8(w):
    def scene(*layers):
        return w.scene([{"model": "suzanne", "meta": True}, {"model": "suzanne", "meta": True}], *layers)

    report = w.report_settings()
    matte = {"look": {"kind": "matte", "color": [0.62, 0.6, 0.56]}, "frames": {"count": 2}}
    matte["camera"] = {"azimuth": 20, "elevation": 8, "margin": 0.2}  # surfaces of high constants are larger
    # All use our surface, so that only the field differs.
    report["surface"] = {"resolution": 64}
    rows, images, heads = [], [], []
    for name, constant in (("low", 0.1), ("medium", 0.15), ("high", 0.4), ("ours", None)):
        layers = [report, matte, {"report": {"blob_constant": constant}}] if constant else [matte]
        path = scene(*layers)
        points, triangles = w.mesh(path, 1)
        component_count = geometry.components(points, triangles)
        rows.append([name, constant, component_count, geometry.volume(points, triangles)])
        images += w.render(path, [1], 230, 220)
        heads.append(f"{name}: blob constant {constant}" if constant else "ours: fitted balls")
    # Faces of an open model do not give its volume; the program counts points of a lattice inside it.
    truth = rows[-1][3] / w.spheres("suzanne")[0]["volume_ratio"]
    rows = [[*row[:3], row[3] / truth] for row in rows]
    w.picture(draw.sheet([images], [""], heads))
    w.table(["", "blob constant", "parts", "volume over the model's"], rows)
    w.say(
        f"The report's field on {w.name_of('suzanne')}: {rows[0][2]} part{'s' * (rows[0][2] > 1)} with {rows[0][3]:.2f}"
        f" of the model's volume at a low constant, {rows[2][3]:.2f} of it at a high one. Ours: {rows[3][3]:.3f}, with"
        " no constant to set.",
        "1/d² never ends, so every constant trades gaps against swelling. A fit chooses each ball's strength, size and "
        "stretch by the distance of the surface from the model, and one shift of all strengths makes the volume exact.",
    )


def bricks_of(cells, side=7):
    """Returns the bricks of side^3 cells that contain these cells."""
    return np.unique(cells // side, axis=0)


@figure(
    "graph5.1",
    "Threads against resolution",
    "A thread for each vertex of the grid: 8000 at a resolution of 20, growing with its cube.",
    models=("torus",),
    scenes=(REPORT_SCENE,),
)
def graph5_1(w):
    rows = []
    settings = w.report_settings()
    for n in (8, 10, 15, 20, 25, 50, 100, 200):
        layer = {"surface": {"resolution": n}, "report": {"flat": False}, "frames": {"count": 2}}
        path = w.scene([{"model": "torus", "meta": True}, {"model": "torus", "meta": True}], settings, layer)
        cells, _ = geometry.crossed_cells(*w.mesh(path, 1))
        rows.append([n, n**3, len(cells), 512 * len(bricks_of(cells))])
    n, grid_points, cells, points = np.array(rows).T
    fig, axes = draw.panels(2, width=1000, height=360)
    for ax, in_range in ((axes[0], n <= 25), (axes[1], n > 0)):
        ax.plot(n[in_range], grid_points[in_range], "o-", color=draw.REPORT, label="the report: a thread for each point, n³")
        if in_range.all():
            ax.plot(n[in_range], points[in_range], "s-", color=draw.OURS, label="points of the bricks that the torus crosses")
        ax.plot(n[in_range], cells[in_range], "^-", color=draw.GREEN, label="cells that it crosses")
        ax.set(xlabel="resolution n of the grid", ylabel="how many")
        ax.legend()
    axes[1].set(xscale="log", yscale="log", title="further than the report went")
    axes[0].set(title="the report's range")
    w.picture(fig)
    w.table(["resolution", "points of the grid (n³)", "cells crossed", "points of bricks crossed"], rows)
    last = rows[-1]
    fewer = next((r[0] for r in rows if r[3] < r[1]), None)
    w.say(
        f"n³ again, beside what the surface of a torus needs at that resolution: of {last[1]:,} points at n ="
        f" {last[0]}, {last[2]:,} cells hold any surface, in bricks of {last[3]:,} points.",
        "Here bricks of 7³ cells whose field interval excludes the surface are never sampled, so work grows with the"
        f" square of the resolution; of the resolutions here, they leave points out from n = {fewer} on. Bricks were"
        " counted on the finished surface, which is the least that must be sampled.",
    )


@figure(
    "fig5.10",
    "Independent skin resolution",
    "The field is sampled at a low resolution (green dots), interpolated linearly, and the skin is made from that at a"
    " much higher one, for higher frame rates.",
    models=("suzanne",),
)
def fig5_10(w):
    centers, radii = np.array([[-0.55, -0.1], [0.62, 0.22]]), np.array([0.62, 0.5])

    def field(x, y):
        return sum(np.exp(2 - 2 * ((x - cx) ** 2 + (y - cy) ** 2) / r**2) for (cx, cy), r in zip(centers, radii))

    fine = np.linspace(-1.6, 1.6, 65)
    truth = geometry.enclosed(geometry.marching_squares(field(*np.meshgrid(fine, fine)), fine, fine, 1, False))
    fig, axes = draw.panels(3, width=1060, height=330)
    for ax, title in zip(axes, ("1) sampled coarsely", "2) interpolated", "3) the skin, finely")):
        draw.plain(ax, title)
    coarse = np.linspace(-1.6, 1.6, 9)
    samples = field(*np.meshgrid(coarse, coarse))
    # Bilinear interpolation: along x, then along y.
    by_rows = np.array([np.interp(fine, coarse, row) for row in samples])
    interpolated = np.array([np.interp(fine, coarse, column) for column in by_rows.T]).T
    shade = {"extent": (-1.6, 1.6, -1.6, 1.6), "origin": "lower", "cmap": "Purples", "vmin": 0, "vmax": 8}
    axes[0].imshow(field(*np.meshgrid(np.linspace(-1.6, 1.6, 400), np.linspace(-1.6, 1.6, 400))), **shade)
    axes[0].plot(*np.meshgrid(coarse, coarse), "o", color=draw.GREEN, ms=4.5)
    axes[1].imshow(interpolated, interpolation="bilinear", **shade)
    segments = geometry.marching_squares(interpolated, fine, fine, 1, False)
    exact = geometry.marching_squares(field(*np.meshgrid(fine, fine)), fine, fine, 1, False)
    axes[2].add_collection(LineCollection(exact, colors=draw.OURS, linewidths=1.8, label="from the field itself"))
    axes[2].add_collection(LineCollection(segments, colors=draw.REPORT, linewidths=1.8, label="from coarse samples"))
    axes[2].legend(loc="lower right")
    for ax in axes:
        ax.set(xlim=(-1.62, 1.62), ylim=(-1.62, 1.62))
    w.picture(fig)
    flat_error = 100 * (geometry.enclosed(segments) / truth - 1)

    rows, images, heads = [], [], []
    for influence in (1, 2, 4, 8):
        layer = {"report": {"influence": influence}, "frames": {"count": 2}, "camera": {"azimuth": 20, "elevation": 8}}
        layer["look"] = {"kind": "matte", "color": [0.62, 0.6, 0.56]}
        path = w.scene([{"model": "suzanne", "meta": True}, {"model": "suzanne", "meta": True}], layer)
        rows.append([influence, geometry.volume(*w.mesh(path, 1))])
        images += w.render(path, [1], 230, 220)
        heads.append(f"every {influence} cells" if influence > 1 else "every cell: ours")
    rows = [[n, v, 100 * (v / rows[0][1] - 1)] for n, v in rows]
    w.picture(draw.sheet([images], ["The program: the field computed at every n-th point only"], heads), part="models")
    w.table(["cells between samples", "volume", "off by %"], rows)
    w.say(
        f"The steps again: the skin of the coarse samples is off by {flat_error:+.0f} % of area. On"
        f" {w.name_of('suzanne')}, samples {rows[-1][0]} cells apart are off by {rows[-1][2]:+.1f} % of volume.",
        "`report.influence` is the report's variant. It is not the default: with bricks and short lists of balls the"
        " field is cheap to compute at every point, and Table 6.7 shows what interpolation would buy.",
    )


@figure(
    "fig5.11",
    "Vertex calculation filtering",
    "Points nearer to the centre than the nearest metaball, or further than the furthest, by a threshold T, are left"
    " out.",
    models=("torus", "monkey"),
)
def fig5_11(w):
    fig, axes = draw.panels(4, width=1180, height=330)
    rows = []
    n = 96  # cells along the longest side
    for pair, name in enumerate(("torus", "monkey")):
        tree = w.file(".json")
        surface = w.file(".ply")
        options = ["--method", "active", "--resolution", 6, "--no-fit", "--grid", n]
        w.spheres(name, *options, "--write-spheres", tree, "--write-surface", surface)
        leaves = [s for s in json.loads(tree.read_text())["spheres"] if s["leaf"]]
        centers = np.array([s["center"] for s in leaves])
        points, triangles = geometry.read_mesh(surface)
        low, high = points.min(axis=0), points.max(axis=0)
        cell = (high - low).max() / n
        low, counts = low - cell, np.ceil((high - low) / cell).astype(int) + 3
        center = centers.mean(axis=0)
        distance = np.linalg.norm(centers - center, axis=1)
        margin = 2.5 * cell + max(s["radius"] for s in leaves)
        inner, outer = max(distance.min() - margin, 0), distance.max() + margin
        grid = np.stack(np.meshgrid(*(low[k] + cell * np.arange(counts[k]) for k in range(3)), indexing="ij"), axis=-1)
        center_distance = np.linalg.norm(grid - center, axis=-1)
        in_shell = (center_distance >= inner) & (center_distance <= outer)
        cells = np.floor((points[triangles].mean(axis=1) - low) / cell).astype(int)
        bricks = {tuple(b) for b in bricks_of(cells)}
        in_brick = np.zeros(counts, bool)
        for b in bricks:
            in_brick[tuple(slice(7 * b[k], 7 * b[k] + 8) for k in range(3))] = True
        rows.append([name, len(leaves), in_shell.size, 100 * in_shell.mean(), 100 * in_brick.mean()])

        # The cut of the torus, which lies flat, is seen from above, that of the monkey from the front.
        axis, (right, up) = (1, (0, 2)) if name == "torus" else (2, (0, 1))
        slice_index = int(round((center[axis] - low[axis]) / cell))
        near_slice = np.abs(centers[:, axis] - center[axis]) < 0.6 * max(s["radius"] for s in leaves)
        rotated = points[:, [right, up, axis]]
        outline = geometry.slice_at(rotated, triangles, center[axis] + 1e-4)
        for k, (mask, title, color) in enumerate(
            (
                (in_shell, f"The report: {rows[-1][3]:.0f} % kept", draw.REPORT),
                (in_brick, f"Ours: {rows[-1][4]:.0f} %", draw.OURS),
            )
        ):
            ax = draw.plain(axes[2 * pair + k], f"{name}. {title}", color)
            plane = np.take(mask, slice_index, axis=axis)
            extent = [low[right] - cell / 2, low[right] + cell * (counts[right] - 0.5)]
            extent += [low[up] - cell / 2, low[up] + cell * (counts[up] - 0.5)]
            tint = "#f6e3d8" if color == draw.REPORT else "#dcebf4"
            colors = np.where(
                plane.T[..., None], draw.matplotlib.colors.to_rgb(tint), draw.matplotlib.colors.to_rgb("#b9bfc4")
            )
            ax.imshow(colors, extent=extent, origin="lower", interpolation="nearest")
            ax.plot(*centers[near_slice][:, [right, up]].T, ".", color=draw.GREEN, ms=3)
            ax.add_collection(LineCollection(outline, colors=draw.INK, linewidths=1))
            if k == 0:
                ends = centers[[distance.argmin(), distance.argmax()]]
                ax.plot(*ends[:, [right, up]].T, "o", color=draw.INK, ms=6)
                draw.circles(ax, [center[[right, up]]] * 2, [inner, outer], ec=draw.REPORT, lw=1, ls="--")
            ax.set(xlim=extent[:2], ylim=extent[2:])
    fig.suptitle(
        "a cut through the middle; grey is left out, green are balls, black the nearest and the furthest one and the"
        " surface",
        fontsize=9,
        color=draw.GREY,
    )
    w.picture(fig)
    w.table(
        ["model", "balls", "points of the grid", "kept by the report's shell (%)", "in bricks with surface (%)"], rows
    )
    w.say(
        f"The report's shell keeps {rows[0][3]:.0f} % of the points for the torus and {rows[1][3]:.0f} % for the"
        f" monkey; the bricks of 7³ cells that hold any surface have {rows[0][4]:.0f} and {rows[1][4]:.0f} %.",
        "A shell around one centre fits a ring and little else, and a wrong T cuts the surface. Bricks are left out by"
        " a bound on the field, so the surface is the same to the bit, whatever its shape; there is no setting for it.",
    )


@figure(
    "fig5.13",
    "The two looks",
    "Left, vertex normals and the original texture; right, face normals and a sphere map. One fades to the other, to"
    " convince the observer that both are the same object.",
    models=("penguin", "suzanne"),
    scenes=(REPORT_SCENE,),
)
def fig5_13(w):
    report = {
        **w.report_settings(),
        "frames": {"count": 49},
        "surface": {"resolution": 40},
        "report": {"placement": "midpoint", "flat": True},
    }
    objects = ["penguin", "suzanne"]
    path = w.scene(objects, report)
    stages = [f["stage"] for f in w.json("info", path, "--timeline")["actors"][0]["frames"]]
    # Frame numbers, which start at 1.
    last_look = len(stages) - 1 - stages[::-1].index("look-out") + 1
    first_volume = stages.index("volume") + 2
    top = w.render(path, [1, last_look // 2 + 1, last_look, first_volume], 230, 230)
    ours = w.scene(objects, {"frames": {"count": 49}}, w.coarse())
    bottom = w.render(ours, [1, 14, 20, 25], 230, 230)
    labels = ["The report's method: texture, fading, sphere map, and the balls' surface with face normals"]
    labels.append("Ours: balls from the second picture on, half way in the last")
    w.picture(draw.sheet([top, bottom], labels))
    w.table(["look", "frame", "stage"], [["report", 1, "look-out"], ["report", last_look, "look-out"]], show=False)
    w.say(
        "The fade as the report has it, up to the angular surface that takes over; and ours, where balls wear the"
        " model's own colours from the first frame on.",
        "Colours and textures are pulled back through the balls' motion to the point of the model that each point of"
        " the surface came from, so there is nothing to distract from. `look.kind` `metal` is the report's.",
    )


@figure(
    "fig5.14",
    "Morph states",
    "The state diagram with the look's stages 1 and 6 added, a loop over any number of objects, and a shorter way for "
    "meta-objects.",
    models=("suzanne", "torus", "penguin"),
    scenes=("standard/torus-monkey-penguin.json", REPORT_SCENE),
)
def fig5_14(w):
    chain = ["torus", {"model": "suzanne", "meta": True}, "penguin"]
    scene = {k: v for k, v in w.scene_json("standard/torus-monkey-penguin.json").items() if k == "frames"}
    balls = {"motion": {"interpolate": "balls"}}
    metal_look = w.json("info", w.scene(chain, scene, balls, {"look": {"kind": "metal"}}), "--timeline")
    own_look = w.json("info", w.scene(chain, scene, balls), "--timeline")
    stages = metal_look["stages"]
    fig, axes = draw.panels(
        2, 2, width=1120, height=520, gridspec_kw={"height_ratios": [1.5, 1], "width_ratios": [1, 0.0001]}
    )
    axes[1].axis("off"), axes[3].axis("off")
    ax = axes[0]
    ax.axis("off")
    wide, high, step = 1.72, 0.95, 2.1
    for i, stage in enumerate(stages):
        color = draw.LEVELS[i]
        shape = FancyBboxPatch(
            (i * step, 0), wide, high, boxstyle="round,pad=0.04,rounding_size=0.12", fc="white", ec=color, lw=2
        )
        ax.add_patch(shape)
        ax.text(i * step + wide / 2, 0.77, stage["name"], ha="center", va="center", weight="bold", color=color)
        ax.text(i * step + wide / 2, 0.3, wrap(stage["what"], 22), ha="center", va="center", fontsize=7.5)
        if i:
            arrow(ax, ((i - 1) * step + wide + 0.05, high / 2), (i * step - 0.05, high / 2))
    end = (len(stages) - 1) * step + wide / 2
    start, middle = wide / 2, 2 * step + wide / 2
    arrow(ax, (end, high + 0.08), (start, high + 0.08), "arc3,rad=0.17", draw.INK)
    ax.text((start + end) / 2, high + 1.28, "the target is the next leg's source", ha="center", va="center", fontsize=9)
    arrow(ax, (middle + 0.35, -0.1), (middle - 0.35, -0.1), "arc3,rad=-1.3", draw.GREEN)
    text = "a meta-object has only this stage on either side:\nits balls go on as the next leg's source"
    ax.text(middle, -0.98, text, ha="center", va="center", fontsize=9, color=draw.GREEN)
    ax.set(xlim=(-0.15, end + wide / 2 + 0.15), ylim=(-1.3, high + 1.45))

    # The stage of each frame, in a chain with a meta-object.
    ax = axes[2]
    rows = []
    for y, (name, run) in enumerate((("look metal", metal_look["actors"][0]), ("look own", own_look["actors"][0]))):
        for f in run["frames"]:
            kind = [s["name"] for s in stages].index(f["stage"])
            ax.barh(-y, 1, left=f["frame"] - 0.5, height=0.55, color=draw.LEVELS[kind], ec="white", lw=0.8)
            if y == 0:
                leg = run["legs"][f["leg"]]
                rows.append([f["frame"], f["t"], leg["from"], leg["to"], f["stage"], f["progress"], f["u"]])
        for leg in range(1, len(run["legs"])):
            at = next(f["frame"] for f in run["frames"] if f["leg"] == leg) - 0.5
            ax.plot([at, at], [-y - 0.38, -y + 0.38], color=draw.INK, lw=1.5)
    objects = " → ".join(
        name + (" (meta)" if i == 1 else "") for i, name in enumerate(["torus", w.name_of("suzanne"), "penguin"])
    )
    ax.set(
        yticks=[0, -1],
        yticklabels=["common look (metal)", "own look"],
        xlabel=f"frame of {objects}",
        xlim=(0.5, rows[-1][0] + 0.5),
    )
    ax.spines["left"].set_visible(False)
    ax.tick_params(left=False)
    w.picture(fig)
    w.table(["frame", "t", "from", "to", "stage", "progress", "u"], rows, part="frames", show=False)
    w.table(["stage", "what"], [[s["name"], s["what"]] for s in stages])
    w.say(
        f"Drawn from the program's own table of {len(stages)} stages (`polymorph info --timeline --json`), and when each"
        " is in a chain with a meta-object.",
        "The report counts six states, with the morph's end; here a stage is a closed form of the frame's number, so"
        " any frame can be made alone. With the objects' own look there is nothing to fade, and the two look stages"
        " have no time; between objects' distances, the default, no mesh has to become balls, and the two boundary"
        " stages have none either.",
    )


def wrap(text, width):
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) > width:
            lines.append("")
        lines[-1] += (" " if lines[-1] else "") + word
    return "\n".join(lines)


def arrow(ax, start, end, style="arc3", color=draw.GREY):
    options = {"arrowstyle": "-|>", "mutation_scale": 14, "color": color, "lw": 1.4}
    ax.add_patch(FancyArrowPatch(start, end, connectionstyle=style, **options))
