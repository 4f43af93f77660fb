"""Errors that tests of the Python module expect."""
import polymorph


def raises(code, *words):
    """The error of the program, with its exit code."""
    def check(call):
        try:
            call()
        except polymorph.Error as error:
            assert error.code == code, error.code
            assert all(word in str(error) for word in words), str(error)
        else:
            raise AssertionError("no error")
    return check
