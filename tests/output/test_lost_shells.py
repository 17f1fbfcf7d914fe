"""What files say of a shell whose solve stopped before it converged: it is not popped up, and not the final shape."""

from dataclasses import replace
from pathlib import Path

import pytest

from rodshell.output.drawings import drawing_set, sheet_set
from rodshell.output.files import save
from rodshell.results import Archive, Results
from rodshell.results.facts import facts
from tests.output.sample_archive import sample_archive, table_archive


def lost(archive: Archive, ends: str) -> Archive:
    """The same result, the pop-up with these ends having been out of time."""
    content = archive.results.plain()
    content["pop_up"][ends] |= {"status": "out of time", "stable": None}
    return replace(archive, results=Results.of(content))


@pytest.mark.parametrize(("ends", "final"), [("clamped", "popped_pinned"), ("pinned", "popped_clamped")])
def test_the_final_shape_is_of_a_shell_that_converged(ends: str, final: str) -> None:
    assert lost(sample_archive(), ends).final == final


def test_without_a_shell_that_converged_the_final_shape_is_the_draped_one() -> None:
    assert lost(lost(sample_archive(), "pinned"), "clamped").final == "draped"


def test_where_the_only_shell_was_lost_nothing_is_called_popped_up(tmp_path: Path) -> None:
    archive = lost(table_archive(), "pinned")
    assert archive.final == "popped_pinned"
    drawings = drawing_set(archive)
    stopped = ", not popped up: where the computation stopped"
    assert drawings["supports"].title == f"Support plan{stopped}"
    assert drawings["elevations"].title == f"Elevations{stopped}"
    page = (save(archive, tmp_path / "out", ["report"]) / "report.html").read_text(encoding="utf-8")
    assert "Not popped up, pinned ends: where the computation stopped" in page
    assert "Popped up, pinned ends" not in page


def test_supports_of_a_table_of_rods_have_no_directions_as_on_a_target() -> None:
    content = table_archive().results.plain()
    content["boundary"] = [[0.1 * k, 0.0, 0.0] for k in range(8)]
    sheets, _ = sheet_set(replace(table_archive(), results=Results.of(content)))
    texts = [text.text for sheet in sheets for text in sheet.texts]
    assert any("Supports, pinned ends (free to turn)" in text for text in texts)
    assert not any("tangent" in text or "as on the target" in text for text in texts)


def test_a_known_strength_is_not_said_to_be_missing_where_no_shell_was_found() -> None:
    content = lost(table_archive(), "pinned").results.plain() | {"bending": {"strength": 80e6, "strength_of": "gfrp"}}
    said = facts(Results.of(content))
    assert "How much of their strength the rods use is not known, since no shell was found." in said
    assert not any("No strength was given" in sentence for sentence in said)
