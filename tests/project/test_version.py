"""The version, as the standard library knows it."""

from importlib.metadata import version

import rodshell


def test_it_is_what_the_standard_library_says() -> None:
    assert rodshell.__version__ == version("rodshell")
