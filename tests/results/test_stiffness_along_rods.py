"""Rods whose sections change along them, from the form to its files and back."""

import csv
from dataclasses import replace

import numpy as np
import pytest

import rodshell as rs
from rodshell.errors import OutputError
from rodshell.formfinding import Footprint
from rodshell.formfinding.pipeline import popped_again
from rodshell.output.grid import joint_places
from rodshell.results.results import Results

REMESHED = 2e-5  # of the size: the result's mesh and that of the table of rods divide the tails differently
TAPER = rs.Profile.symmetric((0.15, 0.7, 1.0))
DOUBLE = rs.Profile.double(0.65)


def varied_form(profile, **keys):
    form = rs.Job.load("hemisphere", layout__spacing="60 mm", checks__stages=0, **keys).run(until="pop-up")
    stages = form.patches[0]
    footprint = Footprint(stages.footprint.mesh.with_profiles(profile))
    return replace(form, stages=popped_again(stages, footprint, stages.boundary, "pinned"))


@pytest.fixture(scope="module", params=[TAPER, DOUBLE], ids=["taper", "double"])
def form(request):
    return varied_form(request.param)


def test_an_archive_keeps_profiles_and_its_rods_pop_up_from_flat_to_the_same_shape(form, tmp_path):
    folder = form.save(tmp_path / "first", kinds="csv")
    archive = rs.read(folder)
    again = rs.Job.of_table(folder).run(until="pop-up")
    for rod, other in zip(again.footprint.rods, form.footprint.rods, strict=True):
        assert rod.profile.stations == pytest.approx(other.profile.stations, abs=1e-12)
        assert (rod.profile.factors, rod.profile.varies) == (other.profile.factors, other.profile.varies)
    before = joint_places(archive, archive.states["popped_pinned"])
    popped = again.archive()
    after = joint_places(popped, popped.states["popped_pinned"])
    assert before.keys() == after.keys()
    assert max(np.abs(before[name] - after[name]).max() for name in before) < REMESHED * form.target.size
    for rod, other in zip(popped.results.rods, archive.results.rods, strict=True):
        assert rod.mass == pytest.approx(other.mass, rel=1e-9)
        assert rod.max_stress == pytest.approx(other.max_stress, rel=1e-2)


def test_the_schedule_of_sections_gives_every_segment(form, tmp_path):
    folder = form.save(tmp_path, kinds="csv")
    with (folder / "schedule" / "sections.csv").open() as file:
        rows = list(csv.DictReader(file))
    profile, rod = form.footprint.rods[0].profile, form.rod
    own = [row for row in rows if row["rod"] == form.footprint.rods[0].name]
    length = 1e3 * form.footprint.rods[0].length
    first, last = ([float(row[name]) for row in own] for name in ("from_mm", "to_mm"))
    assert [first[0], last[-1]] == pytest.approx([0.0, length], abs=0.01)
    assert first[1:] == last[:-1]
    if profile is TAPER:
        sizes, stiff = ([float(row[name]) for row in own] for name in ("size_from_mm", "EI_from_Nm2"))
        at = [first.index(pytest.approx(s * length, abs=0.01)) for s in profile.stations[:-1]]
        assert [sizes[k] for k in at] == pytest.approx(
            [2e3 * rod.section.radius * f**0.25 for f in (0.15, 0.7, 1.0, 0.7)], rel=1e-3
        )
        assert stiff[at[2]] == pytest.approx(rod.bend_stiffness, rel=1e-5)
        _require_built(own, profile, rod, length)
    else:
        assert [*first, length] == pytest.approx([s * length for s in dict.fromkeys(profile.stations)], abs=0.01)
        assert [row["laths"] for row in own] == ["1", "2", "1"]
        assert float(own[1]["EI_from_Nm2"]) == pytest.approx(2 * rod.bend_stiffness, rel=1e-5)


def _require_built(own, profile, rod, length):
    """A round rod turned to diameters that are linear between those of the schedule has the profile's EI within 1 %."""
    first, last, begin, end = (
        np.array([float(row[name]) for row in own]) for name in ("from_mm", "to_mm", "size_from_mm", "size_to_mm")
    )
    share = np.linspace(0.0, 1.0, 801)
    diameter = np.interp(share * length, np.append(first, last[-1]), np.append(begin, end[-1]))
    built = rod.material.youngs_modulus * np.pi / 64 * (1e-3 * diameter) ** 4
    wanted = rod.bend_stiffness * np.interp(share, profile.stations, profile.factors)
    assert np.abs(built / wanted - 1).max() < 0.011  # sizes are written to .01 mm of some 3 mm: .3 %
    assert begin[1:] == pytest.approx(end[:-1])


def test_drawings_and_models_of_rods_that_vary_can_be_made(form, tmp_path):
    folder = form.save(tmp_path, kinds="svg, gltf, report, pdf")
    strips = (folder / "drawings" / "strips.svg").read_text()
    assert ("2 L" if form.footprint.rods[0].profile is DOUBLE else "1.24") in strips  # 2 mm times 0.15^(1/4)


def test_second_laths_are_in_the_stock_plan_and_in_every_total(tmp_path):
    form = varied_form(DOUBLE, fabrication__stock_length="300 mm", fabrication__end_allowance="10 mm")
    folder = form.save(tmp_path, kinds="csv, report, svg")
    rods, sections, bars = (
        list(csv.DictReader((folder / "schedule" / f"{name}.csv").open())) for name in ("rods", "sections", "stock")
    )
    pieces = [(mark, cut) for row in bars for bar in row["marks"].split("; ")
              for mark, cut in zip(bar.split(" + "), row["pieces_mm"].split("; "), strict=True)]  # fmt: skip
    first, second = (
        {rod["id"]: sum(float(cut) for name, cut in pieces if name.split(".")[0] == rod["id"] + lath) for rod in rods}
        for lath in ("", "-2")
    )
    doubled = {row["rod"]: float(row["to_mm"]) - float(row["from_mm"]) for row in sections if row["laths"] == "2"}
    assert second == pytest.approx(doubled, abs=0.05)
    assert second == pytest.approx({rod["id"]: float(rod["second_laths_mm"]) for rod in rods}, abs=0.05)
    assert first == pytest.approx({rod["id"]: float(rod["cut_length_mm"]) for rod in rods}, abs=0.05)
    for rod in rods:
        cut = 1e-3 * (first[rod["id"]] + second[rod["id"]])
        assert float(rod["mass_kg"]) == pytest.approx(form.rod.mass_per_length * cut, rel=1e-3)
        splices = [set(rod[f"{of}splices_from_cut_end_mm"].split("; ")) for of in ("", "second_laths_")]
        assert not set.intersection(*splices) - {""}
    said = f"{1e-3 * sum(second.values()):.1f} m of second laths"
    assert f"{1e-3 * sum(first.values()):.1f} m, and {said}" in form.summary(verbose=True)
    for name in ("report.html", "drawings/plan.svg"):
        assert said in (folder / name).read_text()
    assert "  S2<" in (folder / "drawings/strips.svg").read_text()
    assert rs.read(folder).results.rods[0].stiffness.splices == form.results().rods[0].stiffness.splices


def test_uniform_rods_have_no_stiffness_in_the_result(tmp_path):
    results = varied_form(None).results()
    assert all("stiffness" not in rod.plain() for rod in results.rods)


def test_damaged_stations_are_one_sentence(form):
    plain = form.results().plain()
    plain["rods"][1]["stiffness"]["factors"] = [1.0]
    with pytest.raises(OutputError, match=r"rods\[1\].stiffness"):
        Results.of(plain)
