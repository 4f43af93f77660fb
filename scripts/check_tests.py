#!/usr/bin/env python3
"""Checks that every source file of src/ has a test: tests/unit/ROOM_NAME_test.cpp, tests/cli/NAME_test.cpp, or those that
tests/sources.tsv names for sources that are tested through another interface or the program. Checks also that the rooms of
scripts/sanitize have tests. Prints what is missing or stale; exit code 1."""
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
TESTS = ROOT / "tests"
named_tests = dict(line.split("\t") for line in (TESTS / "sources.tsv").read_text(encoding="utf-8").splitlines() if line and line[0] != "#")


def own_tests(source: pathlib.Path) -> list[pathlib.Path]:
    room = source.parts[0]
    names = [TESTS / "unit" / f"{room}_{source.stem}_test.cpp"]
    if room == "cli":
        names.append(TESTS / "cli" / f"{source.stem.removesuffix('_command')}_test.cpp")
    return [name for name in names if name.exists()]


problems = []
sources = sorted(path.relative_to(ROOT / "src") for path in (ROOT / "src").rglob("*.cpp"))
for source in sources:
    named = named_tests.pop(source.as_posix(), "")
    if not own_tests(source) and not named:
        problems.append(f"{source} has no test: write tests/unit/{source.parts[0]}_{source.stem}_test.cpp, or name one in tests/sources.tsv")
    problems += [f"tests/sources.tsv names tests/{name}, which does not exist" for name in named.split() if not (TESTS / name).exists()]
problems += [f"tests/sources.tsv names src/{source}, which does not exist" for source in named_tests]
rooms = subprocess.run([ROOT / "scripts/sanitize", "--rooms"], capture_output=True, text=True, check=True).stdout.split()
problems += [f"scripts/sanitize runs test_{room}, which does not exist" for room in rooms if room != "backend" and not any(TESTS.glob(f"unit/{room}_*_test.cpp"))]
print("\n".join(problems) if problems else f"tests: ok ({len(sources)} sources)")
sys.exit(1 if problems else 0)
