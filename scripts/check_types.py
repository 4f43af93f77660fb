#!/usr/bin/env python3
"""Finds types of one name in one program: structs, classes and enums of namespace polymorph that two files define.
A compiler does not see them (ill-formed, no diagnostic required); the preset `odr` lets the linker look as well."""
import collections
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
NOISE = re.compile(r'//[^\n]*|/\*.*?\*/|R"\((?:.*?)\)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.S)
SCOPE = re.compile(
    r"(?P<anonymous>\bnamespace\s*\{)|(?P<namespace>\bnamespace\s+[\w:]+\s*\{)"
    r"|\b(?:struct|class|enum\s+class|enum)\s+(?:alignas\([^)]*\)\s*)?(?P<type>[A-Z]\w*)\s*(?:final\s*)?(?::(?!:)[^;{]*)?\{"
    r"|(?P<open>\{)|(?P<close>\})"
)


def types_of(path: pathlib.Path):
    """Names of types that stand in no anonymous namespace, no function and no other type."""
    text = NOISE.sub(" ", path.read_text(encoding="utf-8"))
    scopes: list[str] = []
    for match in SCOPE.finditer(text):
        if match["close"]:
            if scopes:
                scopes.pop()
            continue
        if match["type"] and all(scope == "namespace" for scope in scopes):
            before = text[: match.start()].rstrip()
            if not before.endswith("template <>") and "<" not in text[match.start() : match.end()].split("{")[0].split(":")[0]:
                yield match["type"]
        scopes.append("anonymous" if match["anonymous"] else "namespace" if match["namespace"] else "block")


places = collections.defaultdict(list)
count = 0
for pattern in ("src/**/*.h", "src/**/*.cpp", "kernels/*.h", "kernels/*.cuh"):
    for path in sorted(ROOT.glob(pattern)):
        for name in types_of(path):
            places[name].append(path.relative_to(ROOT).as_posix())
            count += 1
twice = {name: files for name, files in places.items() if len(files) > 1}
for name, files in sorted(twice.items()):
    print(f"{name}: {', '.join(files)}")
if count < 200:
    print(f"found only {count} types: the pattern of this script is out of date")
    twice = {"": []}
if not twice:
    print(f"types: ok ({count})")
sys.exit(1 if twice else 0)
