"""The case file: everything that decides one job, read from TOML, completed, and written back in SI."""

from rodshell.case.case import Built, Case
from rodshell.case.keys import CaseKey, case_keys
from rodshell.case.load import BUILT_IN, load_case

__all__ = ["BUILT_IN", "Built", "Case", "CaseKey", "case_keys", "load_case"]
