"""Progress of long calls, reported to a function of the caller or as a line in a notebook."""
import contextlib
import sys

from .error import Error


@contextlib.contextmanager
def reporting(progress):
    """Yields the function to call with stage and seconds, or None. progress: as for Scene."""
    if progress is False or (progress is None and not _in_notebook()):
        yield None
    elif progress is None or progress is True:
        try:
            from tqdm.auto import tqdm  # type: ignore[import-untyped]
        except ImportError:
            if progress:
                raise Error("progress=True needs tqdm - pip install tqdm, or give a function", 2) from None
            yield None
            return
        line = _Line(tqdm)
        try:
            yield line
        finally:
            line.close()
    elif callable(progress):
        yield progress
    else:
        raise Error("progress: give a function of stage and seconds, True, False or None", 2)


class _Line:
    """A line that names the stage and counts seconds; short calls show none."""

    def __init__(self, tqdm):
        self._tqdm = tqdm
        self._bar = None

    def __call__(self, stage, seconds):
        if self._bar is None:
            self._bar = self._tqdm(bar_format="{desc} {elapsed}", leave=False)
        self._bar.set_description_str(stage)

    def close(self):
        if self._bar is not None:
            self._bar.close()


def _in_notebook():
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return type(shell).__name__ == "ZMQInteractiveShell"
