"""Sections as the trade calls them: what is read, what is written, and what cannot be meant."""

import pytest

import rodshell as rs
from rodshell.case import load_case
from rodshell.cli import main
from rodshell.errors import InputError
from rodshell.results.results import Results
from rodshell.results.wording import section_text
from rodshell.rods.section import TRADE_SIZES, section_from, size_text

SOLD = sorted({size for sizes in TRADE_SIZES.values() for size in sizes}, key=size_text)
MEANT = {
    "rod 12": rs.Circle(0.006),
    "tube 32x3": rs.Tube(0.016, 0.003),
    "Tube 32 x 3 mm": rs.Tube(0.016, 0.003),
    "tube 3.2 \N{MULTIPLICATION SIGN} 0.3 cm": rs.Tube(0.016, 0.003),
    "tube 1.25in x 3": rs.Tube(0.5 * 1.25 * 0.0254, 0.003),
    "lath 12x40": rs.RectangularSection(width=0.012, height=0.040),
    "lath 40x12": rs.RectangularSection(width=0.012, height=0.040),
    "strip 2x40": rs.RectangularSection(width=0.040, height=0.002),
    "ellipse 20x30": rs.Ellipse(0.010, 0.015),
}
REFUSED = {
    "tube 3x32": r"wall of 32 mm is thicker than half of its diameter, 3 mm: .*\"tube 32x3\"",
    "lath 12": r"\"lath 12\": after \"lath\" comes the thickness and the breadth, .*\"lath 12x40\"",
    "rod -1": r"\"rod -1\": must be larger than zero; after \"rod\" comes the diameter",
    "rod 0": "larger than zero",
    "rod nan": "not a finite number",
    "rod 12 kg": "kg is a unit of mass; after",
    "tube 32x3x4": 'after "tube" comes the outer diameter and the wall',
    "tube x3": 'after "tube" comes',
    "pipe 32x3": '"pipe 32x3": give a section .*"tube 32x3"',
    "32x3": '"32x3": give a section',
    "": "give a section",
}


@pytest.mark.parametrize("words", MEANT)
def test_a_section_is_read_in_mm_unless_a_unit_is_written(words: str) -> None:
    assert section_from(words) == MEANT[words]
    assert load_case("pavilion", {"rod": words}).rod.build().section == MEANT[words]
    table = f'kind = "cables"\nsection = "{words}"\nmaterial = {{ preset = "gfrp" }}'
    case = load_case(f'rod.section = "{words}"\nrod.material.preset = "gfrp"\n[bracing]\n{table}\n')
    assert case.rod.build().section == MEANT[words]
    assert case.bracing.rod.section == MEANT[words]  # type: ignore[union-attr]


@pytest.mark.parametrize("section", [*SOLD, *MEANT.values()], ids=size_text)
def test_what_is_written_is_read_again(section: rs.Circle) -> None:
    """Of all sizes that are sold: to the bit, as both ways round once."""
    assert section_from(size_text(section)) == section
    assert size_text(section_from(size_text(section))) == size_text(section)
    content = {
        "rod": {"section": load_case("pavilion", {"rod": size_text(section)}).rod.build().parameters()["section"]}
    }
    assert section_text(Results.of(content).rod.section) == size_text(section)  # type: ignore[union-attr]


@pytest.mark.parametrize("words", REFUSED)
def test_a_size_that_cannot_be_meant_is_one_sentence(words: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(rs.InputError, match=REFUSED[words]):
        section_from(words)
    assert main(["form", "pavilion", "--rod", words]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    with pytest.raises(rs.InputError, match=REFUSED[words]):
        load_case("pavilion", {"rod.section": words}).build()


def test_a_diameter_stands_in_place_of_the_radius() -> None:
    for changes in ({"rod.section.diameter": "38 mm"}, {"rod.section.radius": "19 mm"}):
        assert load_case("pavilion", changes).rod.build().section == rs.Tube(0.019, 0.003)
    assert load_case("pavilion", {"rod.section.diameter": "auto"}).rod.left_open == ("section",)
    case = load_case('[bracing]\nkind = "cables"\nsection = { diameter = "6 mm" }\nmaterial = { preset = "gfrp" }\n')
    assert case.bracing.rod.section == rs.Circle(0.003)  # type: ignore[union-attr]
    with pytest.raises(rs.InputError, match=r"rod.section.diameter and radius are given: leave one of them out"):
        load_case("pavilion", {"rod.section.diameter": "38 mm", "rod.section.radius": "19 mm"})
    with pytest.raises(rs.InputError, match=r'rod.section.diameter = "-1 mm": must be larger than zero'):
        load_case("pavilion", {"rod.section.diameter": "-1 mm"})
    with pytest.raises(rs.InputError, match=r"unknown key rod.section.diamter: did you mean rod.section.diameter"):
        load_case("pavilion", {"rod.section.diamter": "38 mm"})


def test_a_section_in_words_replaces_the_whole_of_another_and_single_keys_change_it() -> None:
    case = load_case("pavilion", {"rod": "lath 12x40"})
    assert case.rod.build() == rs.Rod(MEANT["lath 12x40"], rs.Material.preset("gfrp"))
    thicker = load_case("pavilion", {"rod": "tube 32x3", "rod.section.thickness": "4 mm"})
    assert thicker.rod.build().section == rs.Tube(0.016, 0.004)
    job = rs.Job.load("pavilion", rod="tube 38x3.5").changed({"rod.section": "rod 12"})
    assert job.case.rod.build().section == rs.Circle(0.006)


def test_a_section_that_is_given_may_be_left_to_the_target_again() -> None:
    case = load_case("pavilion", {"rod": "auto"})
    assert "section" in case.rod.left_open
    with pytest.raises(InputError, match="give a section with its measures in mm"):
        section_from("auto")
