"""Makes all standard models, and SOURCES.md, which describes them."""
import concurrent.futures
import importlib
import os

# (module, names of the models that it makes)
MODULES = [("simple", ["cube", "puddle", "sphere", "torus"]), ("teapot", ["teapot"]),
           ("penguin", ["penguin"]), ("monkey", ["monkey"]), ("spider", ["spider"]),
           ("humanoid", ["humanoid"])]

INTRO = """# Standard models

Made by `scripts/make_models`, which re-creates every file here; do not edit
them by hand.  Y is up, the models look toward +Z (left parts lie at +X), stand
on y = 0 and are centred in x and z.  Every shell is closed and faces outward.
Textures are named relative to the MTL file.

| model | what | vertices | triangles | shells | genus | volume | size (x, y, z) |
|---|---|---|---|---|---|---|---|
"""

LICENCE = """## Licence

The models and their textures are designs of this project, made by its own
generator: Apache-2.0, like the rest.  No other model was copied.

The teapot's control points are Martin Newell's (University of Utah, 1975; the
four patches of the bottom were added later by others).  They were published
without a stated licence; the same numbers stand in three.js (TeapotGeometry,
MIT).  The caps, ledge, skirt and throat that close the shells are ours.
"""


def make(job):
    """Writes the models of one module. Returns lines for the table of SOURCES.md and for the list below it."""
    module, folder, only = job
    rows, notes = [], []
    for m in importlib.import_module("models." + module).build():
        if only and m.name not in only:
            continue
        f = m.write(folder)
        genus = ", ".join(str(g) for g in f["genus"])
        rows.append((m.name, "| %s | %s | %d | %d | %d | %s | %.4f | %.2f, %.2f, %.2f |" % (
            (m.name, m.about, f["vertices"], f["triangles"], f["shells"], genus, f["volume"])
            + tuple(f["extent"]))))
        tex = ""
        if m.image is not None:
            tex = "  Texture `%s.png`, %d x %d." % (m.name, m.image.shape[1], m.image.shape[0])
        notes.append((m.name, "- **%s**: %s.%s  Groups: %s." % (
            m.name, m.how, tex, ", ".join("`%s`" % g for g in f["groups"]))))
    return rows, notes


def write(folder, only=None, jobs=1):
    todo = [(module, folder, only) for module, names in MODULES if not only or set(only) & set(names)]
    if jobs > 1:
        with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
            done = list(pool.map(make, todo))
    else:
        done = [make(job) for job in todo]
    if only:
        return
    rows = sorted(r for d in done for r in d[0])
    notes = sorted(n for d in done for n in d[1])
    with open(os.path.join(folder, "SOURCES.md"), "w", newline="\n") as out:
        out.write(INTRO + "\n".join(r for _, r in rows) + "\n\n")
        out.write("The volume of a model of several shells is the sum over its shells.\n\n")
        out.write("## How each is made, and its groups\n\n")
        out.write("\n".join(n for _, n in notes) + "\n\n" + LICENCE)
