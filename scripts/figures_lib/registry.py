"""The list of figures, and the code that each depends on."""

import ast
import dataclasses
import hashlib
import inspect
import pathlib
import sys
import typing

HERE = pathlib.Path(__file__).resolve().parent
FIGURES = []
# Files that every picture depends on. page.py is left out, because index.html is written on every run.
SHARED = ["draw.py", "geometry.py", "work.py"]


@dataclasses.dataclass
class Figure:
    name: str
    title: str
    report: str  # what the report shows and says, with its numbers
    make: typing.Callable
    models: tuple = ()  # of scenes/models, without .obj; "suzanne" is Blender's or our monkey
    scenes: tuple = ()  # below scenes/
    machine: bool = False  # measures the machine, so it is made again on another one


def figure(name, title, report, models=(), scenes=(), machine=False):
    """Decorates the function that makes a figure. It gets a work.Work."""

    def register(make):
        FIGURES.append(Figure(name, title, report, make, tuple(models), tuple(scenes), machine))
        return make

    return register


def names():
    return [f.name for f in FIGURES]


def is_figure(node):
    """Tests whether a syntax node is a function with the decorator figure()."""
    return isinstance(node, ast.FunctionDef) and any(
        isinstance(d, ast.Call) and getattr(d.func, "id", "") == "figure" for d in node.decorator_list
    )


def code_of(chosen):
    """Returns the code of a figure without comments and layout: its module except for other figures, and SHARED."""
    module = ast.parse(inspect.getsource(sys.modules[chosen.make.__module__]))
    module.body = [n for n in module.body if not is_figure(n) or n.name == chosen.make.__name__]
    shared = [ast.unparse(ast.parse((HERE / file).read_text(encoding="utf-8"))) for file in SHARED]
    return ast.unparse(module) + "".join(shared)


def digest(*parts):
    """Returns the SHA-256 of bytes and of values as text, each with its length."""
    hasher = hashlib.sha256()
    for part in parts:
        data = part if isinstance(part, bytes) else str(part).encode()
        hasher.update(len(data).to_bytes(8, "little") + data)
    return hasher.hexdigest()
