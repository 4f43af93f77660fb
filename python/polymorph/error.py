"""The exception of the package, in a file of its own so that the C++ module can import it."""


class Error(RuntimeError):
    """The message says what went wrong, why, and what to do about it, in the program's words.

    code: the program's exit code for this error: 2 usage, 3 a bad scene, model or texture, 4 cannot write, 5 device or memory.
    """

    def __init__(self, message: str, code: int):
        super().__init__(message)
        self.code = code
