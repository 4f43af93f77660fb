#!/usr/bin/env python3
"""Finds structs, classes and enums of namespace polymorph that two files define under the same name.
Compilers need not report such breaches of the one-definition rule; the preset `odr` lets the linker look for them, too."""
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
    """Yields the names of types outside anonymous namespaces, functions and other types."""
    text = NOISE.sub(" ", path.read_text(encoding="utf-8"))
    scopes: list[str] = []
    for match in SCOPE.finditer(text):
        if match["close"]:
            if scopes:
                scopes.pop()
            continue
        if match["type"] and all(scope == "namespace" for scope in scopes):
            # Skip specializations of templates.
            before = text[: match.start()].rstrip()
            if not before.endswith("template <>") and "<" not in text[match.start() : match.end()].split("{")[0].split(":")[0]:
                yield match["type"]
        scopes.append("anonymous" if match["anonymous"] else "namespace" if match["namespace"] else "block")


files_by_name = collections.defaultdict(list)
count = 0
for pattern in ("src/**/*.h", "src/**/*.cpp", "kernels/*.h", "kernels/*.cuh"):
    for path in sorted(ROOT.glob(pattern)):
        for name in types_of(path):
            files_by_name[name].append(path.relative_to(ROOT).as_posix())
            count += 1
duplicates = {name: files for name, files in files_by_name.items() if len(files) > 1}
for name, files in sorted(duplicates.items()):
    print(f"{name}: {', '.join(files)}")
if count < 200:
    print(f"found only {count} types: the pattern of this script is out of date")
    duplicates = {"": []}
if not duplicates:
    print(f"types: ok ({count})")
sys.exit(1 if duplicates else 0)
