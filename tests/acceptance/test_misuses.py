"""What users get wrong is refused in one sentence that names it: in Python, in a case file and as an option."""

from pathlib import Path

import pytest

from tests.acceptance.misuses import MISUSES, Misuse, case_fault, option_fault, python_fault


@pytest.mark.parametrize("misuse", MISUSES, ids=lambda misuse: misuse.what)
def test_a_misuse_is_refused_in_one_sentence_at_every_door(misuse: Misuse, tmp_path: Path) -> None:
    faults = {
        "Python": python_fault(misuse),
        "case file": case_fault(misuse, tmp_path),
        "option": option_fault(misuse, tmp_path),
    }
    assert not any(faults.values()), faults
