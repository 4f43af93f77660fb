#!/usr/bin/env python3
"""bench_tables_test.py POLYMORPH: scripts/bench_tables writes what a fresh run of `polymorph bench` has measured, and finds a table
that was changed by hand. The tables of docs/performance.md are those of their stored runs."""
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = pathlib.Path(sys.argv[1]).resolve()
PAGE = "# Figures\n\n<!-- bench: here -->\n<!-- bench end -->\n\nThe end.\n"


def tables(*options, code=0) -> str:
    done = subprocess.run([ROOT / "scripts/bench_tables", *map(str, options)], capture_output=True, text=True, check=False)
    assert done.returncode == code, f"bench_tables {options}: {done.returncode}, {done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def main():
    tables("--check")
    with tempfile.TemporaryDirectory() as path:
        folder = pathlib.Path(path)
        page, run = folder / "page.md", folder / "run.json"
        page.write_text(PAGE)
        subprocess.run([PROGRAM, "bench", "surface", "--device", "cpu", "--torus", "64", "--grid", "24", "--repeats", "2", "--json", run],
                       capture_output=True, check=True)
        where = ["--page", page, "--data", folder / "data"]
        store = ["--store", "here", "--machine", "One machine", "--date", "2026-01-02"]
        row = "surface gaussian 24^3"
        tables(*where, *store, "--peer", row, "VTK", "4.25", run)
        text = page.read_text()
        measured = {row["name"]: row for row in json.loads(run.read_text())["rows"]}
        [line] = [line for line in text.splitlines() if line.startswith(f"| {row} |")]
        _, name, size, time, floor, _, peer, _ = (cell.strip() for cell in line.split("|"))
        assert (name, size, peer) == (row, measured[row]["note"], "VTK: 4.25"), line
        for cell, key in ((time, "median_ms"), (floor, "floor_ms")):
            assert abs(float(cell) - measured[row][key]) <= 0.006 * measured[row][key], (cell, measured[row])
        assert text.count("2 January 2026") == 1 and text.count("One machine; polymorph ") == 1, text
        assert text.startswith("# Figures\n\n<!-- bench: here -->\n") and text.endswith("<!-- bench end -->\n\nThe end.\n"), text
        assert all(f"| {name} |" in text for name in measured), text

        tables(*where, "--check")
        page.write_text(text.replace(time, "0.001"))
        assert "run scripts/bench_tables" in tables(*where, "--check", code=1)
        tables(*where)
        assert page.read_text() == text
        assert "no row is called" in tables(*where, *store, "--peer", "nothing", "VTK", "1", run, code=1)
        tables(*where, run, code=2)
        page.write_text("# No table\n")
        assert "has no `<!-- bench" in tables(*where, code=1)
    print("bench_tables: a run becomes its table")


if __name__ == "__main__":
    main()
