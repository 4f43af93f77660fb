#!/usr/bin/env python3
"""docs_test.py POLYMORPH [--but] [PAGE...]: runs every command of README.md and of the pages in docs/ (default: all; --but: all others)
as people would type it, and checks every scene that stands in them. Prints which commands took longest, by seconds of processor time.

A page's `sh` blocks run in order in a folder of the page's own, which has what the pages take for granted: two models, a scene, the
folders of the checkout with small pictures, an sbatch that runs a job's first task at once. What a page needs besides stands in it as a comment,
`<!-- before: COMMAND -->`. Commands that are not run here name the test that runs them. The README's reader writes the scene first.
Scenes are small, and what is dear whatever the scene is made at draft quality (DRAFT).
Each `json` block with a scene is saved beside the models that come with the program, and checked.
"""
import json
import os
import pathlib
import re
import resource
import runpy
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = pathlib.Path(sys.argv[1]).resolve()
# Examples of commands.md are those of each --help; these have placeholders for people, or are run elsewhere.
GENERATED = {"commands.md", "scene.md"}
ELSEWHERE = {
    "scripts/figures": "figures",
    "chromium": "nothing: a browser's own command",
    "scripts/wheel": "python.wheel", "PYTHON=": "python.wheel", "python3 -m venv": "python.wheel", "env/bin/": "python.wheel",
    "scripts/manual": "manual",
    "scripts/demo": "nothing: it installs packages", "scripts/test": "CI",
    "apt install": "package.deb",
    "scripts/package": "package.reproducible", "docker": "package.deb: it plays the Containerfile",
    "scripts/reproduce": "nothing: it builds the program twice", "sha256sum": "package.reproducible",
}
# What a command of the README does is tested, not how its pictures look; and what it makes twice may be replaced.
QUICK = "overwrite = true\n[render]\npreview = true\n[strip]\npreview = true\n"
# What a command's own options make dear, and what stands in their place here.
DRAFT = [
    (re.compile(r"(strip .*--spp) \d+"), r"\1 1"),
    # A carried mesh has to follow a cube's edges, all of them; a sphere's takes the same way.
    (re.compile(r"(mesh scene\.json --topology constant)"), r"\1 -f 1-6 --set source=sphere"),
    (re.compile(r"(strip walk\.json)"), r"\1 --set spheres.balls=8 --set surface.resolution=16"),
    (re.compile(r"(spheres first\.obj --balls) 64"), r"\1 16 --width 120"),
    (re.compile(r"(render walk\.glb -o \S+)"), r"\1 --preview"),
    # The README's other demo is made as it is.
    (re.compile(r"(demo monkey spider --through puddle)"), r"\1 --set spheres.balls=24 --set surface.resolution=32"),
]
# Typed twice on a page with nothing changed between.
ONCE = {"polymorph demo"}
BLOCK = re.compile(r"```sh\n(.*?)```|<!-- before: (.*?) -->", re.S)
SCENE = re.compile(r"^```json\n(.*?)^```", re.M | re.S)
TINY = {"width": 32, "height": 24, "samples": 1}


def shrink(scene):
    """A scene whose frames take no time."""
    scene["image"] = {**TINY, **{k: v for k, v in scene.get("image", {}).items() if k in ("aovs", "steady")}}
    scene["surface"] = {"resolution": 16}
    scene["spheres"] = {"balls": 8, "fit": "none"}
    frames = scene.setdefault("frames", {})
    for key in ("hold_start", "hold_end"):
        frames.pop(key, None)
    return scene


def read_json(file):
    """JSON with // comments on lines of their own."""
    return json.loads("\n".join(line for line in file.read_text(encoding="utf-8").splitlines() if not line.lstrip().startswith("//")))


def prepare(folder: pathlib.Path):
    cube = ["v %d %d %d" % (x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]
    for name in ("first.obj", "second.obj", "teapot.obj", "penguin.obj"):
        (folder / name).write_text("\n".join([*cube, *faces]) + "\n")
    scene = shrink({"source": "cube", "target": "sphere", "frames": {"count": 24}})
    (folder / "scene.json").write_text(json.dumps(scene))
    for name in ("models", "blends", "effects", "films", "pairs"):
        (folder / "scenes" / name).mkdir(parents=True)
        for file in (ROOT / "scenes" / name).iterdir():
            target = folder / "scenes" / name / file.name
            if file.suffix != ".json":
                target.symlink_to(file)
            elif name == "pairs":
                game = read_json(file)
                game["scene"] = shrink(game.get("scene", {})) | {
                    "frames": {"fps": 1}, "boundary": {"method": "cut"}, "motion": {"interpolate": "balls"}, "spheres": {"method": "octree", "resolution": 3, "fit": "none"}}
                game["moves"] = game.get("moves", [])[:2]
                target.write_text(json.dumps(game))
            else:
                target.write_text(json.dumps(shrink(read_json(file))))
    (folder / "scripts").symlink_to(ROOT / "scripts")
    commands = folder / "bin"
    commands.mkdir()
    (commands / "polymorph").symlink_to(PROGRAM)
    (commands / "sbatch").write_text("#!/bin/sh\nfor script; do :; done\n"
                                      "SLURM_ARRAY_TASK_ID=1 SLURM_CPUS_PER_TASK=1 sh \"$script\" >&2 && echo 77\n")
    (commands / "sbatch").chmod(0o755)


def check_scenes(name: str, text: str, cache: str) -> list[str]:
    problems = []
    with tempfile.TemporaryDirectory() as path:
        folder = pathlib.Path(path) / "scenes"
        folder.mkdir()
        (folder.parent / "models").symlink_to(ROOT / "scenes" / "models")  # for the scenes of scenes/effects
        for file in (ROOT / "scenes" / "models").iterdir():
            (folder / file.name).symlink_to(file)
        for scene in SCENE.findall(text):
            if not json.loads(scene).keys() & {"source", "blend", "actors"}:
                continue  # a golden suite's
            (folder / "scene.json").write_text(scene)
            done = subprocess.run([PROGRAM, "check", "scene.json"], cwd=folder, env=os.environ | {"POLYMORPH_CACHE_DIR": cache},
                                  capture_output=True, text=True, timeout=600, check=False)
            if done.returncode != 0:
                problems.append(f"{name}: the scene\n{scene}is not good:\n{done.stderr.strip()}")
    return problems


def processor_seconds() -> float:
    """User and system time of all commands that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def drafted(command: str) -> str:
    for pattern, instead in DRAFT:
        command = pattern.sub(instead, command)
    return command


def run_page(name: str, text: str, cache: str, seconds: list) -> list[str]:
    blocks = BLOCK.findall(text)
    if not any(block for block, _ in blocks):
        return []
    problems = []
    with tempfile.TemporaryDirectory() as path:
        folder = pathlib.Path(path)
        prepare(folder)
        environment = {k: v for k, v in os.environ.items() if not k.startswith(("POLYMORPH_", "SLURM_", "CI"))}
        environment |= {"PATH": f"{folder}/bin:{environment['PATH']}", "POLYMORPH_CACHE_DIR": cache}
        if name == "README.md":
            (folder / "scene.json").unlink()
            (folder / "bin" / "quick.toml").write_text(QUICK)
            environment["POLYMORPH_CONFIG"] = f"{folder}/bin/quick.toml"
        ran = set()
        count = 0
        for block, before in blocks:
            for line in (block or before).replace("\\\n", " ").splitlines():
                command = line.split("  #")[0].strip()
                if not command or command.startswith("#"):
                    continue
                if block and command.startswith(tuple(ELSEWHERE)) or command in ONCE & ran:
                    continue
                start = processor_seconds()
                done = subprocess.run(["bash", "-euo", "pipefail", "-c", drafted(command)], cwd=folder, env=environment, input="a1 b1\n",
                                      capture_output=True, text=True, timeout=600, check=False)
                seconds.append((processor_seconds() - start, name, command))
                ran.add(command)
                count += 1
                if done.returncode != 0:
                    problems.append(f"{name}: `{command}` ends with {done.returncode}:\n{done.stderr.strip()}")
        print(f"{name}: {count} commands", flush=True)
    return problems


def main():
    but = sys.argv[2:3] == ["--but"]
    named = set(sys.argv[3 if but else 2:])
    pages = {page.name: page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs").glob("*.md")) if page.name not in GENERATED}
    pages["README.md"] = (ROOT / "README.md").read_text(encoding="utf-8")
    pages["cookbook.md"] = runpy.run_path(str(ROOT / "scripts/manual"))["cookbook"]()
    assert named <= pages.keys(), f"no such page: {named - pages.keys()}"
    pages = {name: text for name, text in pages.items() if not named or (name in named) != but}
    seconds = []
    with tempfile.TemporaryDirectory() as cache:
        problems = [problem for name, text in pages.items() for problem in check_scenes(name, text, cache) + run_page(name, text, cache, seconds)]
    print("\n".join(f"{spent:7.1f} s  {name}: {command}" for spent, name, command in sorted(seconds, reverse=True)[:15]))
    print(f"{processor_seconds():7.1f} s  all commands and scenes")
    print("\n".join(problems) if problems else f"docs: the scenes and commands of {len(pages)} pages work")
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
