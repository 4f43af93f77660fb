"""Runs the program for figures, writes their files, and tests whether these are up to date."""

import csv
import datetime
import io
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import time
import traceback

import matplotlib
import matplotlib.image
import matplotlib.pyplot as plt
import numpy as np

from . import registry

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
MODELS = ROOT / "scenes/models"
REPORT_SCENE = "golden/report-method.json"
# Exports Blender's monkey Suzanne, which looks along +Z, with Y up. Blender before 3.3 has only the second operator.
EXPORT_SUZANNE = """
import bpy, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_monkey_add()
bpy.ops.object.shade_smooth()
path = sys.argv[-1]
if hasattr(bpy.ops.wm, "obj_export"):
    bpy.ops.wm.obj_export(filepath=path, export_materials=False)
else:
    bpy.ops.export_scene.obj(filepath=path, use_materials=False)
"""


def write_atomically(path, data):
    temporary = path.with_name(path.name + ".part")
    temporary.write_bytes(data if isinstance(data, bytes) else data.encode())
    os.replace(temporary, path)


class FigureRun:
    """The output folder, the program and the quality of all figures of a run.

    The stamp of a figure, stamps/NAME.json, holds the digest of its inputs, its files and its texts.
    """

    def __init__(self, options):
        self.folder = pathlib.Path(options.dir).resolve()
        self.stamps = self.folder / "stamps"
        self.stamps.mkdir(parents=True, exist_ok=True)
        self.program = options.program.resolve()
        self.quality = options.quality
        self.blender = shutil.which(options.blender) if options.blender else None
        modules = sorted(self.program.parent.glob("*.so"))
        self.program_digest = registry.digest(*(p.read_bytes() for p in [self.program, *modules]))
        self.version = self.run("--version").strip()
        self.machine = None
        self.analyses = {}  # by scene and number of frames; Figures 6.1 to 6.4 and Table 6.4 need the same ones

    def run(self, *arguments, cwd=None):
        done = subprocess.run(
            [self.program, *map(str, arguments)], capture_output=True, text=True, cwd=cwd, stdin=subprocess.DEVNULL
        )
        if done.returncode != 0:
            raise RuntimeError(
                f"polymorph {' '.join(map(str, arguments))}\nended with {done.returncode}: {done.stderr}"
            )
        return done.stdout

    def model(self, name):
        if name != "suzanne":
            return MODELS / f"{name}.obj"
        return self.suzanne() if self.blender else MODELS / "monkey.obj"

    def suzanne(self):
        """Returns the OBJ file of Suzanne, which Blender exports once."""
        path = self.folder / "models/suzanne.obj"
        if not path.exists():
            path.parent.mkdir(exist_ok=True)
            script = path.with_name("export.py")
            script.write_text(EXPORT_SUZANNE)
            temporary = path.with_name("part.obj")
            command = [self.blender, "--background", "--python-exit-code", "1", "--python", script, "--", temporary]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            os.replace(temporary, path)
            script.unlink()
        return path

    def input_files(self, figure):
        files = [ROOT / "scenes" / s for s in figure.scenes]
        for name in figure.models:
            path = self.model(name)
            files += [path, *(p for e in (".mtl", ".png") if (p := path.with_suffix(e)).exists())]
        return files

    def digest(self, figure):
        """Returns the digest of all that a figure depends on."""
        parts = [self.program_digest, self.quality, matplotlib.__version__, figure.title, registry.code_of(figure)]
        for path in self.input_files(figure):
            parts += [path.name, path.read_bytes()]
        if figure.machine:
            self.machine = self.machine or self.run("devices", "--json")
            parts.append(self.machine)
        return registry.digest(*parts)

    def stamp_of(self, figure):
        try:
            return json.loads((self.stamps / f"{figure.name}.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None

    def is_current(self, figure):
        stamp = self.stamp_of(figure)
        return (
            stamp is not None
            and stamp["digest"] == self.digest(figure)
            and all((self.folder / file).exists() for file in stamp["files"])
        )

    def make(self, figure):
        """Makes a figure; returns None, or the traceback of a failure. The stamp is written last, so a failed figure is made again."""
        digest = self.digest(figure)
        start = time.monotonic()
        with tempfile.TemporaryDirectory(prefix="polymorph-figures-") as scratch:
            work = Work(self, figure, pathlib.Path(scratch))
            try:
                figure.make(work)
            except Exception:
                return traceback.format_exc()
            finally:
                plt.close("all")
        stamp = {
            "digest": digest,
            "made": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
            "seconds": round(time.monotonic() - start, 1),
            "quality": self.quality,
            "ours": work.ours,
            "why": work.why,
            "blocks": work.blocks,
            "files": work.files,
            "commands": work.commands,
        }
        write_atomically(self.stamps / f"{figure.name}.json", json.dumps(stamp, indent=1) + "\n")
        return None


def models_only_settings():
    """Returns the cheapest settings for scenes that show only models, never balls."""
    cheap = {"method": "octree", "resolution": 3, "fit": "none"}
    still = {"frames": {"count": 2}, "motion": {"interpolate": "balls"}}  # distances take seconds to compute
    return {"spheres": cheap, "boundary": {"method": "cut"}, "plan": {"method": "index"}, **still}


class Work:
    """Gives the function of a figure its declared inputs and the program, and collects its results."""

    def __init__(self, figure_run, figure, scratch):
        self.figure_run, self.figure, self.scratch = figure_run, figure, scratch
        self.draft = figure_run.quality == "draft"
        self.ours = self.why = ""
        self.blocks, self.files, self.commands = [], [], []
        self.count = 0

    # Inputs. A figure may use only those that it declares, because its digest depends on no others.

    def model(self, name):
        if name not in self.figure.models:
            raise KeyError(f"{self.figure.name} does not declare the model {name}")
        return self.figure_run.model(name)

    def name_of(self, model):
        """Returns a model's name for captions."""
        if model == "suzanne":
            return "Suzanne" if self.figure_run.blender else "monkey"
        return model

    def scene_json(self, name):
        if name not in self.figure.scenes:
            raise KeyError(f"{self.figure.name} does not declare the scene {name}")
        return json.loads((ROOT / "scenes" / name).read_text(encoding="utf-8"))

    # Runs of the program.

    def short(self, text):
        """Returns a command with paths relative to the repository's root, as the page shows it."""
        for path, name in ((self.scratch, "work/"), (self.figure_run.folder, ""), (ROOT, "")):
            text = text.replace(f"{path}/", name)
        return text

    def run(self, *arguments):
        self.commands.append(f"polymorph {self.short(' '.join(str(a) for a in arguments))}")
        return self.figure_run.run(*arguments, cwd=self.scratch)

    def json(self, *arguments):
        return json.loads(self.run(*arguments, "--json", "-q"))

    def file(self, suffix):
        self.count += 1
        return self.scratch / f"{self.count}{suffix}"

    def scene(self, objects, *layers):
        """Writes a scene file of these objects (names of models, or dicts with "model" or "shape"). Later layers override settings."""

        def with_path(entry):
            entry = {"model": entry} if isinstance(entry, str) else dict(entry)
            if "model" in entry and not isinstance(entry["model"], pathlib.Path):
                entry["model"] = self.model(entry["model"])
            return {k: str(v) if isinstance(v, pathlib.Path) else v for k, v in entry.items()}

        first, *between, last = [with_path(o) for o in objects]
        scene = {"source": first, "target": last}
        if between:
            scene["intermediate"] = between
        for layer in layers:
            for key, value in layer.items():
                scene[key] = {**scene.get(key, {}), **value} if isinstance(value, dict) else value
        path = self.file(".json")
        path.write_text(json.dumps(scene), encoding="utf-8")
        self.commands.append(f"cat > work/{path.name} <<< '{self.short(json.dumps(scene))}'")
        return path

    def coarse(self):
        """Returns coarse settings for the small pictures of a draft, and no settings for a final."""
        return {"spheres": {"balls": 64}, "surface": {"resolution": 48}} if self.draft else {}

    def report_settings(self):
        """Returns the settings of the report's own method, with its 27 cells and its angular surface."""
        scene = self.scene_json(REPORT_SCENE)
        keep = {k: scene[k] for k in ("spheres", "field", "plan", "motion", "boundary", "look")}
        variant = {**scene["report"], "placement": "midpoint", "flat": True}
        return {**keep, "report": variant, "surface": {"resolution": 27, "min_component_share": 0}}

    def render(self, scene, frames, width=200, height=150, samples=None):
        """Renders frames of a scene to arrays. width, height: pixels in a draft; a final has 1.5 times as many."""
        if not self.draft:
            width, height = width * 3 // 2, height * 3 // 2
        self.count += 1
        pattern = self.scratch / f"{self.count}.####.png"
        settings = {"width": width, "height": height, "samples": samples or (4 if self.draft else 96)}
        sets = [x for key, value in settings.items() for x in ("--set", f"image.{key}={value}")]
        frames = list(frames)
        listed = ",".join(str(f) for f in sorted(set(frames)))
        self.run("render", scene, "-o", pattern, "-f", listed, "-q", "--progress", "none", *sets)
        return [read_picture(self.scratch / f"{self.count}.{f:04d}.png") for f in frames]

    def mesh(self, scene, frame):
        """Returns points and triangles of a frame's surface."""
        from . import geometry

        path = self.file(".ply")
        self.run("mesh", scene, "-f", frame, "-o", path, "-q")
        return geometry.read_mesh(path)

    def analyze(self, scene, frames=13):
        """Returns the analysis of each morph of a scene, as `polymorph analyze --json` has it."""
        key = (scene.read_text(encoding="utf-8"), frames)
        if key not in self.figure_run.analyses:
            self.figure_run.analyses[key] = self.json("analyze", scene, "-c", frames)["morphs"]
        return self.figure_run.analyses[key]

    def spheres(self, model, *options, picture=0):
        """Returns the report of `polymorph spheres` on a model (a name or a path), and pictures of model, spheres and surface."""
        path = model if isinstance(model, pathlib.Path) else self.model(model)
        if not picture:
            return self.json("spheres", path, *options), None
        file = self.file(".png")
        width = picture if self.draft else picture * 3 // 2
        report = self.json("spheres", path, *options, "-o", file, "--width", width)
        sheet = read_picture(file)
        gap = (sheet.shape[1] - 3 * width) // 4  # beside and between the three pictures, which have labels below
        return report, [sheet[gap : gap + width, gap + k * (width + gap) :][:, :width] for k in range(3)]

    # Results.

    def save(self, name, data):
        write_atomically(self.figure_run.folder / name, data)
        self.files.append(name)

    def picture(self, fig, caption="", part=""):
        """Saves a matplotlib figure: a sheet of renders as PNG, a drawing as PNG and SVG."""
        stem = self.figure.name + (f"-{part}" if part else "")
        exact = getattr(fig, "pixel_exact", False)
        block = {"kind": "picture", "png": f"{stem}.png", "caption": caption}
        block["width"] = round(fig.get_figwidth() * fig.dpi)
        if exact:  # the boxes of the renders, in pixels from the upper left
            height = round(fig.get_figheight() * fig.dpi)
            boxes = [axes.get_window_extent() for axes in fig.axes]
            block["panels"] = [[round(v) for v in (b.x0, height - b.y1, b.x1, height - b.y0)] for b in boxes]
        for format in ["png"] if exact else ["png", "svg"]:
            buffer = io.BytesIO()
            options = {"dpi": fig.dpi} if exact else {}
            metadata = {"Date": None} if format == "svg" else {"Software": None}
            fig.savefig(buffer, format=format, metadata=metadata, facecolor="white", **options)
            self.save(f"{stem}.{format}", buffer.getvalue())
            block[format] = f"{stem}.{format}"
        self.blocks.append(block)

    def table(self, head, rows, caption="", part="", show=True, marks=None):
        """Saves a CSV file. show: whether the page has it as a table. marks(row, column): the CSS class of a cell."""
        stem = self.figure.name + (f"-{part}" if part else "")
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([head, *rows])
        self.save(f"{stem}.csv", text.getvalue())
        block = {"kind": "table", "csv": f"{stem}.csv", "caption": caption, "show": show}
        if show:
            block["head"], block["rows"] = list(head), [[format_cell(c) for c in row] for row in rows]
            if marks:
                block["marks"] = [[marks(i, j) or "" for j in range(len(head))] for i in range(len(rows))]
        self.blocks.append(block)

    def say(self, ours, why=""):
        """Sets the texts of the page: what our picture shows, and what differs from the report and why."""
        self.ours, self.why = ours, why


def read_picture(path):
    """Returns the RGB values of a picture, 0 to 1: (height, width, 3)."""
    return np.asarray(matplotlib.image.imread(path), float)[:, :, :3]


def format_cell(value):
    """Returns a value as tables show it: numbers with four significant digits, no exponent."""
    if value is None:
        return "–"
    if isinstance(value, bool) or not isinstance(value, float):
        return str(value)
    if value == 0 or abs(value) >= 1000:
        return f"{value:.0f}"
    return f"{value:.4g}" if abs(value) >= 0.001 else f"{value:.4f}".rstrip("0").rstrip(".")
