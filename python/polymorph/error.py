"""The exception of the package, in a file of its own, so that the module can import it."""


class Error(RuntimeError):
    """What went wrong, why, and what to do about it, as the program would say it.

    code: the program's exit code for it: 2 usage, 3 a bad scene, model or texture, 4 cannot write, 5 device or memory.
    """

    def __init__(self, message: str, code: int):
        super().__init__(message)
        self.code = code
