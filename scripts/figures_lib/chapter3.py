"""Chapter 3: marching squares and the damped spring."""

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection

from . import draw, geometry
from .registry import figure

# The 5 tiles to which the 16 cases reduce: a flag per corner, 1 inside, counter-clockwise from the lower left.
TILES = [(0, 0, 0, 0), (1, 0, 0, 0), (1, 1, 0, 0), (1, 0, 1, 0), (1, 1, 1, 1)]


def curve(x, y):
    """Returns a field that is above 0 inside a bean-shaped curve."""
    angle = np.arctan2(y, x)
    return 1.0 + 0.28 * np.cos(2 * angle + 0.6) + 0.16 * np.sin(3 * angle) - np.hypot(x, y)


@figure(
    "fig3.2",
    "A curve by marching squares",
    "The 16 cases of a square come down to 5 tiles; the tiles put together approximate the curve. Tiles are fixed"
    " drawings, so lines end at the middles of edges.",
)
def fig3_2(w):
    fig = draw.plt.figure(figsize=(9.6, 3.6), layout="constrained")
    grid = fig.add_gridspec(5, 3, width_ratios=[0.22, 1, 1])
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    for row, tile in enumerate(TILES):
        ax = draw.plain(fig.add_subplot(grid[row, 0]), "" if row else "the 5 tiles")
        values = np.array([[tile[0], tile[1]], [tile[3], tile[2]]], float)
        draw.outline(ax, square, color=draw.GREY, lw=0.8)
        for p, inside in zip(square, tile):
            ax.plot(*p, "o", ms=5, color=draw.INK if inside else "white", mec=draw.INK, mew=0.8)
        ax.add_collection(
            LineCollection(geometry.marching_squares(values, [0, 1], [0, 1], 0.5, True), colors=draw.REPORT)
        )
        ax.set(xlim=(-0.2, 1.2), ylim=(-0.2, 1.2))

    n = 11
    x = np.linspace(-1.5, 1.5, n)
    values = curve(*np.meshgrid(x, x))
    fine = np.linspace(-1.5, 1.5, 1501)
    # The square has an area of 9.
    truth = float((curve(*np.meshgrid(fine, fine)) > 0).mean() * 9)
    rows = []
    for column, (midpoint, name, color) in enumerate(
        ((True, "The report's tiles: edge midpoints", draw.REPORT), (False, "Ours: where the field says", draw.OURS))
    ):
        segments = geometry.marching_squares(values, x, x, 0, midpoint)
        area = geometry.enclosed(segments)
        rows.append([name, n - 1, area, truth, 100 * (area / truth - 1)])
        ax = draw.plain(fig.add_subplot(grid[:, 1 + column]), f"{name}, area off by {rows[-1][4]:+.1f} %", color)
        ax.add_collection(
            PolyCollection(
                [[(a, b), (a + 0.3, b), (a + 0.3, b + 0.3), (a, b + 0.3)] for a in x[:-1] for b in x[:-1]],
                facecolors="none",
                edgecolors=draw.LIGHT,
                linewidths=0.7,
            )
        )
        ax.contour(
            fine[::10], fine[::10], curve(*np.meshgrid(fine[::10], fine[::10])), [0], colors=draw.GREY, linewidths=1
        )
        xx, yy = np.meshgrid(x, x)
        ax.plot(xx[values > 0], yy[values > 0], "o", ms=3.4, color=draw.INK)
        ax.plot(xx[values <= 0], yy[values <= 0], "o", ms=3.4, color="white", mec=draw.GREY, mew=0.7)
        ax.add_collection(LineCollection(segments, colors=color, linewidths=2))
        ax.set(xlim=(-1.56, 1.56), ylim=(-1.56, 1.56))
    w.picture(fig)
    w.table(["placement", "squares an axis", "area", "true area", "off by %"], rows)
    w.say(
        f"The same {n - 1} x {n - 1} squares both ways. Midpoints miss the area by {rows[0][4]:+.1f} %, interpolated "
        f"vertices by {rows[1][4]:+.1f} %.",
        "In space likewise: `report.placement` `midpoint` is the report's, the default places each vertex on its edge"
        " by a step of refinement on the field.",
    )


@figure(
    "graph3.1",
    "Damping, several coefficients",
    "Harmonic oscillation with differing damping coefficients: displacement between -6 and 6 over a time of 45. Not"
    " built (requirement 3.5, left as future work). The curves' coefficients are not given.",
    models=("cube",),
)
def graph3_1(w):
    frames = 241
    scene = w.scene(
        ["cube", {"shape": "sphere"}],
        {"frames": {"count": frames}, "boundary": {"method": "cut"}, "motion": {"easing": "spring"}},
    )
    spring = w.json("info", scene)["motion"]["easing"]
    critical = 2 * (spring["stiffness"] * spring["mass"]) ** 0.5
    fig, [ax] = draw.panels(1, width=900, height=380)
    curves, rows = {}, []
    for ratio, color in (
        (0.08, draw.LEVELS[0]),
        (0.2, draw.OURS),
        (0.5, draw.GREEN),
        (1, draw.INK),
        (2.5, draw.REPORT),
    ):
        damping = round(ratio * critical, 2)
        frame_states = w.json("info", scene, "--timeline", "--set", f"motion.easing.damping={damping}")["actors"][0]["frames"]
        t, u = np.array([f["time"] for f in frame_states]), np.array([f["u"] for f in frame_states])
        kind = "under" if ratio < 1 else "critically " if ratio == 1 else "over"
        ax.plot(t, 1 - u, color=color, label=f"b = {damping:.1f} ({kind}damped)")
        curves[damping] = u
        settled = np.nonzero(np.abs(1 - u) > 0.02)[0].max() + 1
        rows.append([damping, ratio, float(u.max() - 1), float(t[min(settled, len(t) - 1)])])
    ax.axhline(0, color=draw.GREY, lw=0.8)
    ax.set(xlabel="time of the motion", ylabel="displacement from the target", xlim=(0, 1))
    ax.legend(title=f"m = {spring['mass']:g}, k = {spring['stiffness']:g}", title_fontsize=9)
    w.picture(fig)
    heads = ["damping b", "of the critical one", "overshoot", "within 2 % from time"]
    w.table(heads, rows, caption="Each curve comes from `polymorph info --timeline`.")
    w.table(
        ["time", *curves],
        [[float(a), *map(float, us)] for a, *us in zip(t, *curves.values())],
        part="curves",
        show=False,
    )
    w.say(
        f"Equation 3.4 as polymorph computes it, let go at displacement 1, from b = {rows[0][0]:g}, which overshoots by"
        f" {100 * rows[0][2]:.0f} %, to b = {rows[-1][0]:g}, which never does.",
        "Built here as `motion.easing` `spring`: the motion always ends exactly on the target, and a ball's mass"
        " follows its share of the volume, so that big balls lag behind.",
    )
