"""The command line program that travels in this package."""
import os
import pathlib
import sys

PROGRAM = pathlib.Path(__file__).resolve().parent / "bin" / "polymorph"


def main():
    """Becomes the program; its exit code is the process's."""
    os.execv(PROGRAM, [sys.argv[0], *sys.argv[1:]])
