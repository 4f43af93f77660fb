"""Starts the command-line program that is installed with this package."""
import os
import pathlib
import sys

PROGRAM = pathlib.Path(__file__).resolve().parent / "bin" / "polymorph"


def main():
    """Replaces this process by the program, so that the exit code is the program's."""
    os.execv(PROGRAM, [sys.argv[0], *sys.argv[1:]])
