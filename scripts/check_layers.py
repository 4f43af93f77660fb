#!/usr/bin/env python3
"""Checks the includes of src/ and kernels/. A room (a folder of src/) may include only itself and the rooms before it in ROOMS; a
subfolder of a room only those before it in SUBFOLDERS; kernels/ no room. The files of each folder in WITHOUT_CIRCLES must not include
each other in a circle. ONLY_IN names the folder that may include a library. Rooms that pictures depend on must not call the C library's
sines and powers, which differ between machines. Code for some GPUs alone is that of architecture 9.0 and newer. Prints every breach; exit code 1 if there is one."""
import pathlib
import re
import sys

ROOMS = ["base", "image", "mesh", "scene", "model", "field", "spheres", "morph", "leg", "render", "device", "compare", "interchange", "analyze", "assets", "sequence", "film", "export",
         "golden", "farm", "inspect", "bench", "starter", "pairs", "options", "cli"]
SUBFOLDERS = {"model": ["repair", "load"],
              "render": ["math", "rays", "lights", "materials", "path", "film", "device"],
              "sequence": ["prepare", "frame"]}
WITHOUT_CIRCLES = ["leg", "assets", "sequence/prepare", "sequence/frame", "film", "export"]
PUBLIC_KERNEL_HEADERS = {"kernels/types.h", "kernels/field_kinds.h", "kernels/host_device.h", "kernels/simd_math.h", "kernels/linear.h", "kernels/ball_paths.h", "kernels/mesh.h",
                "kernels/ball_set.h", "kernels/devices.h", "kernels/engine.h", "kernels/morph_surface.h", "kernels/fork_join.h", "kernels/interruption.h", "kernels/large_pages.h", "kernels/mc_tables.h",
                "kernels/floating_point.h", "kernels/morph_field.h", "kernels/distance_field.h"}
ONLY_IN = {"embree3/": "src/render", "openexr.h": "src/image", "libdeflate.h": "src/image", "OpenImageIO/": "src/image/oiio", "OpenColorIO/": "src/image/ocio", "CLI/": "src/options", "meshoptimizer.h": "src/interchange", "assimp/": "src/model/assimp",
           "nlohmann/": "src/base", "nettle/": "src/base"}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.M)

# base/exact_math.h has these functions with equal bits on all machines. The rooms of EXEMPT only measure, or write for other programs.
LIBRARY_MATH = re.compile(r"\bstd::(a?sin|a?cos|a?tan|atan2|sinh|cosh|tanh|exp2?|expm1|log|log2|log10|log1p|pow|cbrt|hypot)f?\(")
EXEMPT = {"compare", "interchange", "analyze", "bench", "options", "cli"}
ONE_GPU = re.compile(r"__CUDA_ARCH__\s*(?!>= 900\b)[<>=!]")


def breaches(root: pathlib.Path):
    """Yields a message per breach, except for circles."""
    for path in sorted(root.glob("src/**/*.[ch]*")) + sorted(root.glob("kernels/*.*")):
        name = path.relative_to(root).as_posix()
        parts = name.split("/")
        room = parts[1] if parts[0] == "src" and len(parts) > 2 else None
        text = path.read_text(encoding="utf-8")
        if room not in EXEMPT:
            for call in LIBRARY_MATH.finditer(text):
                yield f"{name}: {call[0]}...) differs between machines; see base/exact_math.h"
        if ONE_GPU.search(text):
            yield f"{name}: has code for some GPUs alone, but CI compiles for architectures 7.5 and 9.0 (.ci/run)"
        for include in INCLUDE.findall(text):
            for header, home in ONLY_IN.items():
                if include.startswith(header) and not name.startswith(home + "/"):
                    yield f"{name}: includes {include}, which belongs to {home}/"
            target = include.split("/")[0]
            if parts[0] == "kernels" and target in ROOMS:
                yield f"{name}: includes {include}, but kernels/ knows no room"
            if room and target in ROOMS and ROOMS.index(target) > ROOMS.index(room):
                yield f"{name}: includes {include}, but {target}/ comes after {room}/"
            folders = SUBFOLDERS.get(room, [])
            if target == room and len(parts) > 3 and parts[2] in folders and include.split("/")[1] in folders:
                if folders.index(include.split("/")[1]) > folders.index(parts[2]):
                    yield f"{name}: includes {include}, but {include.split('/')[1]}/ comes after {parts[2]}/"
            if room and include.startswith("kernels/") and include not in PUBLIC_KERNEL_HEADERS:
                yield f"{name}: includes {include}; only {', '.join(sorted(PUBLIC_KERNEL_HEADERS))} are for the rooms"


def circles(root: pathlib.Path, folder: str):
    """Yields the circles in which files of a folder include each other. A header and its source count as one file."""
    includes = {}
    for path in sorted((root / "src" / folder).glob("**/*.[ch]*")):
        name = path.relative_to(root / "src").with_suffix("").as_posix()
        targets = {include.removesuffix(".h") for include in INCLUDE.findall(path.read_text(encoding="utf-8"))}
        includes.setdefault(name, set()).update(target for target in targets if target.startswith(folder + "/") and target != name)
    done, stack = set(), []

    def visit(name):
        if name in stack:
            yield "src: " + " -> ".join([*stack[stack.index(name):], name]) + " is a circle"
        elif name not in done:
            stack.append(name)
            for target in sorted(includes.get(name, ())):
                yield from visit(target)
            stack.pop()
            done.add(name)

    for name in includes:
        yield from visit(name)


root = pathlib.Path(__file__).resolve().parent.parent
problems = [*breaches(root), *(circle for folder in WITHOUT_CIRCLES for circle in circles(root, folder))]
print("\n".join(problems) if problems else "layers: ok")
sys.exit(1 if problems else 0)
