"""The Python snippets of docs/python.md, in order, in one namespace, as a reader would type them, but for the number of balls: drafts."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
page = (ROOT / "docs/python.md").read_text(encoding="utf-8")
for surface in ('"surface": {"resolution": 48}', '"surface": {"resolution": 32}'):
    assert surface in page
    page = page.replace(surface, surface + ', "spheres": {"balls": 24}')
assert 'surface={"resolution": 48}' in page
page = page.replace('surface={"resolution": 48}', 'surface={"resolution": 48}, spheres={"balls": 24}')
blocks = list(re.finditer(r"^```python\n(.*?)^```", page, re.M | re.S))
assert len(blocks) > 3, "found no snippets"
namespace = {}
for block in blocks:
    line = page[: block.start(1)].count("\n")
    exec(compile("\n" * line + block[1], "docs/python.md", "exec"), namespace)  # pylint: disable=exec-used
assert namespace["few"].shape == (3, 120, 160, 4) and namespace["depth"].shape == (120, 160)
assert len(namespace["way"]) == 5 and namespace["approximation"].spheres.shape == (64, 4)
print(f"the {len(blocks)} snippets of docs/python.md: ok", file=sys.stderr)
