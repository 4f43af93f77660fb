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
# Code that every picture depends on. page.py is not among it, because index.html is written on every run.
SHARED = ["draw.py", "geometry.py", "work.py"]


@dataclasses.dataclass
class Figure:
    name: str
    title: str
    report: str  # what the report shows and says, with its numbers
    make: typing.Callable
    models: tuple = ()  # of scenes/models, without .obj; "suzanne" is Blender's or our monkey
    scenes: tuple = ()  # below scenes/
    machine: bool = False  # measures this machine; made again on another one


def figure(name, title, report, models=(), scenes=(), machine=False):
    """Decorates the function that makes a figure. It gets a work.Work."""

    def register(make):
        FIGURES.append(Figure(name, title, report, make, tuple(models), tuple(scenes), machine))
        return make

    return register


def names():
    return [f.name for f in FIGURES]


def is_figure(node):
    return isinstance(node, ast.FunctionDef) and any(
        isinstance(d, ast.Call) and getattr(d.func, "id", "") == "figure" for d in node.decorator_list
    )


def code_of(chosen):
    """Returns the figure's module without its other figures, and the shared code, without comments and layout."""
    module = ast.parse(inspect.getsource(sys.modules[chosen.make.__module__]))
    module.body = [n for n in module.body if not is_figure(n) or n.name == chosen.make.__name__]
    shared = [ast.unparse(ast.parse((HERE / file).read_text(encoding="utf-8"))) for file in SHARED]
    return ast.unparse(module) + "".join(shared)


def digest(*parts):
    hasher = hashlib.sha256()
    for part in parts:
        data = part if isinstance(part, bytes) else str(part).encode()
        hasher.update(len(data).to_bytes(8, "little") + data)
    return hasher.hexdigest()
