"""A project that uses rodshell as a library, checked with `mypy --strict` by `test_downstream.py`."""
