"""Chapter 6: speed, measured on this machine."""

from . import draw
from .registry import figure

# Table 6.7: frames per second by influence resolution (key) and skin resolution 10 to 100 (index).
REPORT_FPS = {
    10: [30, 30, 30, 30, 20, 17, 12, 9, 7, 5],
    20: [30, 30, 30, 29, 20, 13, 10, 10, 9, 5],
    30: [13, 12, 10, 9, 6, 5, 4, 4, 3, 3],
    40: [3, 3, 3, 3, 2, 2, 2, 2, 2, 2],
}
SKIN = range(10, 101, 10)
BALLS = 1032  # number of balls of the report's torus


def run_bench(w, field):
    return w.json("bench", "report", "--torus", BALLS, "--field", field, "--repeats", 3 if w.draft else 25)


def describe_machine(w):
    """Returns the names of the processor and of the GPUs, if there are any."""
    devices = w.json("devices")
    parts = [f"{devices['cpu']['name']}, {devices['cpu']['threads']} threads", *(d["name"] for d in devices["cuda"])]
    return "; ".join(parts)


@figure(
    "graph6.1",
    "CPU against GPU",
    "Frames a second of the influence kernel on CPU and GPU: CUDA allows higher resolutions without a loss of frame"
    " rate, and drops, too, in the end. (AMD Athlon 64 X2 at 2 GHz, GeForce 9800 GT; a chart whose numbers are not in"
    " the text.)",
    machine=True,
)
def graph6_1(w):
    fig, [ax] = draw.panels(1, width=900, height=400)
    table = {skin: [skin] for skin in SKIN}
    heads = ["grid resolution"]
    machine = describe_machine(w)
    cuda = False
    for field, name, color in (
        ("inverse_square", "the report's field, 1/d²", draw.REPORT),
        ("gaussian", "ours, Gaussian", draw.OURS),
    ):
        rows = [r for r in run_bench(w, field)["rows"] if r["name"] == "graph 6.1"]
        for key, style, device in (("cpu_ms", "o-", "CPU"), ("cuda_ms", "s--", "GPU")):
            if key not in rows[0]:
                continue
            cuda |= key == "cuda_ms"
            rates = [1000 / r[key] for r in rows]
            ax.plot([r["skin"] for r in rows], rates, style, color=color, label=f"{device}, {name}")
            heads.append(f"{device}, {name}: surfaces a second")
            for r, rate in zip(rows, rates):
                table[r["skin"]].append(rate)
    ax.axhline(30, color=draw.GREY, lw=1, ls=":")
    ax.text(10, 29, "30 a second: the report's bar", color=draw.GREY, fontsize=8.5, va="top")
    ax.set(
        xlabel="grid resolution",
        ylabel="surfaces a second",
        yscale="log",
        ylim=(min(20, min(min(r[1:]) for r in table.values()) * 0.8), None),
    )
    ax.legend()
    w.picture(fig)
    w.table(heads, list(table.values()), caption=f"{BALLS} balls on a torus, as many as the report's. {machine}")
    first, last = table[10], table[100]
    w.say(
        f"Field and surface of {BALLS} balls: {first[1]:.0f} a second at 10 cells and {last[1]:.1f} at 100 with the"
        f" report's field, {first[-1 if not cuda else 3]:.0f} and {last[-1 if not cuda else 3]:.0f} with ours, on"
        " the CPU"
        + ("; the GPU's curves are dashed." if cuda else ". There is no GPU here, so its curves are missing."),
        "The report timed every ball at every grid point, without making a surface. Bricks with their own lists of"
        " balls leave almost all of that out, which a Gaussian allows better than a field that never ends.",
    )


@figure(
    "table6.7",
    "Frames a second over skin and influence resolution",
    "The whole system on its GPU; settings with satisfactory rates were shown in green. At 30 a second up to a skin "
    "resolution of 40 with influence at 10.",
    machine=True,
)
def table6_7(w):
    heads = ["influence \\ skin", *map(str, SKIN)]
    report = [[str(influence), *rates] for influence, rates in REPORT_FPS.items()]
    w.table(
        heads, report, caption="The report: frames per second", part="report", marks=lambda i, j: mark(report[i][j], j)
    )
    worst, ours = {}, {}
    for field, name in (("inverse_square", "the report's field, 1/d²"), ("gaussian", "ours, Gaussian")):
        bench_rows = [r for r in run_bench(w, field)["rows"] if r["name"] == "table 6.7"]
        rows = [[str(i), *(round(r["per_second"]) for r in bench_rows if r["influence"] == i)] for i in REPORT_FPS]
        caption = f"Here, {name}: surfaces a second"
        w.table(
            heads,
            rows,
            caption=caption,
            part=field.replace("_", "-"),
            marks=lambda i, j, rows=rows: mark(rows[i][j], j),
        )
        volume_errors = [[str(i), *(r["volume_off_percent"] for r in bench_rows if r["influence"] == i)] for i in REPORT_FPS]
        caption = f"Here, {name}: volume off by %, through interpolation"
        w.table(heads, volume_errors, caption=caption, part=f"{field.replace('_', '-')}-volume", show=field == "gaussian")
        ours[field] = rows
        worst[field] = max(abs(x) for row in volume_errors for x in row[1:])
    slowest = min(x for row in ours["gaussian"] for x in row[1:])
    w.say(
        f"Surfaces alone, without drawing, on {describe_machine(w)}: never below {slowest} a second with our field. The"
        f" coarsest influence misses the volume by {worst['gaussian']:.0f} %.",
        "The report's rate includes its rendering and its GPU of 2008. Its influence resolution bought speed with"
        " accuracy; here the field is computed at every point (influence at least the skin's), and it is fast enough."
        " Green: 25 or more.",
    )


def mark(rate, column):
    return "good" if column and rate >= 25 else ""
