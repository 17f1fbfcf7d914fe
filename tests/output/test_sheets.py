"""Sheets can be read on paper, and say what they are and what they leave out."""

import os
import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import rodshell as rs
from rodshell.errors import InputError
from rodshell.figures.records import Ends
from rodshell.joints import Joint, joint_parameters
from rodshell.output.drawing import CAPITAL, LETTER, TEXT, Drawing
from rodshell.output.drawings import drawing_set, sheet_set
from rodshell.output.drawings.flat import flat_drawing, flat_plan
from rodshell.output.drawings.sheets import BLOCK, MARGIN, MORE, ROW, laid_out, room, title_block
from rodshell.output.pdf import drawings_pdf
from rodshell.output.settings import PAPERS, DrawingStyle
from rodshell.results import Archive, Results
from rodshell.results.wording import rounding_of
from tests.acceptance.cases import ROD
from tests.output.forms import archive, form, wished
from tests.output.hostile import hostile_archive
from tests.output.sample_archive import sample_archive, table_archive

ENDS = ("pinned", "clamped")


def sheets(made: Archive) -> list[Drawing]:
    return sheet_set(made)[0]


def styled(made: Archive, **style: object) -> Archive:
    return replace(made, results=Results.of({**made.results.plain(), "drawings": style}))


@pytest.mark.slow
@pytest.mark.parametrize("paper", ["A4", "A3", "A1"])
def test_capitals_are_never_lower_than_iso_3098_has_them(paper: str) -> None:
    """1.8 mm is the smallest height of letters in ISO 3098, 2.5 mm the usual one."""
    sizes = [text.size for sheet in sheets(styled(archive("dome"), paper=paper)) for text in sheet.texts]
    assert CAPITAL * min(sizes) >= 1.8
    assert pytest.approx(2.5, abs=0.02) == CAPITAL * TEXT


@pytest.mark.slow
def test_what_finds_no_room_is_counted_and_said() -> None:
    """The whole plan of the dome on A3 has no room for ids of joints: those written and those left out are all."""
    made = archive("dome")
    plan = flat_plan(made)
    whole = next(sheet for sheet in sheets(made) if sheet.title == "Flat plan")
    ids = {joint.id for joint in plan.joints}
    written = [text.text for text in whole.texts if text.text in ids]
    assert whole.left_out == (f"all of {len(ids)} joint ids (named by the rods that cross)",)
    assert not written
    assert any(whole.left_out[0] in text.text for text in whole.texts)


def test_parts_show_what_the_whole_leaves_out() -> None:
    """All ids of joints stand on the parts, which are no larger than it takes: the next smaller scale has no room."""
    plan, paper = flat_plan(archive("dome")), PAPERS["A3"]

    def compose(text: float) -> Drawing:
        return flat_drawing(plan, text)

    layout = laid_out(compose, np.zeros(2), paper, plan.text)
    _, *shown = layout.sheets(paper)
    texts = {text.text for sheet in shown for text in sheet.content.texts}
    assert {joint.id for joint in plan.joints} <= texts
    coarser = {2.5: 3, 2: 2.5, 1: 2}[shown[0].scale]
    assert compose(TEXT * coarser).left_out


def test_a_sheet_that_shows_all_needs_no_parts() -> None:
    plan, paper = flat_plan(table_archive()), PAPERS["A0"]
    layout = laid_out(lambda text: flat_drawing(plan, text), np.zeros(2), paper, plan.text)
    assert not layout.whole.left_out
    assert layout.detail is layout.whole
    assert len(list(layout.sheets(paper))) == 1


def test_a_drawing_whose_sheet_shows_all_is_laid_out_once_for_files_and_paper() -> None:
    """Only scales at which it does not fit are tried before; none at which it cannot."""
    plan, paper, tried = flat_plan(table_archive()), PAPERS["A3"], list[float]()

    def compose(text: float) -> Drawing:
        tried.append(text)
        return flat_drawing(plan, text)

    extent = np.ptp(plan.cuts.reshape(-1, 2), axis=0)
    layout = laid_out(compose, extent, paper, plan.text)
    assert not layout.whole.left_out
    assert layout.detail is layout.whole
    assert tried[-1] == layout.whole.text == TEXT * layout.scale
    low, high = room(paper)
    assert len(tried) <= 3
    assert np.all(extent / (min(tried) / TEXT) <= high - low)


def judged(made: Archive, level: str, *reasons: str) -> Archive:
    return replace(made, results=Results.of({**made.results.plain(), "verdict": {"level": level, "reasons": reasons}}))


@pytest.mark.parametrize("paper", ["A4", "A3"])
def test_every_sheet_and_drawing_says_that_a_shell_is_not_buildable(paper: str) -> None:
    reason = "with pinned ends the rods use 417 % of their design strength " + "and more " * 40
    made = judged(styled(sample_archive(3, 2), paper=paper), "unbuildable", reason.strip(), "another reason")
    for drawing in [*sheets(made), *drawing_set(made).values()]:
        (line,) = (text for text in drawing.texts if text.text.startswith("Not buildable: with pinned ends"))
        assert line.text.endswith(MORE)
    for sheet in sheets(made):
        block = [text for text in sheet.texts if text.layer == "TITLE" and text.at[1] < MARGIN + BLOCK]
        rows = sorted({round(float(text.at[1]), 3) for text in block if text.anchor == "start" and text.at[0] < 20})
        assert min(np.diff(rows)) > 0.9 * ROW
        assert rows[0] > MARGIN + 1


def test_a_verdict_that_fits_is_whole_and_a_good_one_is_not_said() -> None:
    texts = [text.text for text in sheets(judged(sample_archive(3, 2), "check", "no strength is known"))[0].texts]
    assert "Check: no strength is known" in texts
    assert title_block(judged(sample_archive(3, 2), "good", "it pops up"), "").verdict == ""


@pytest.mark.slow
def test_the_title_block_names_rods_joints_author_and_date() -> None:
    made = styled(wished(), name="Pavilion roof", author="A. Nyone", date="2026-11-22", project="Park", tolerance=5e-4)
    entries = dict(title_block(made, "").entries)
    assert entries["Section"] == "rod 2 mm"
    assert entries["Material"].startswith("E 1 MPa, 1000 kg/m")
    assert (entries["Drawn by"], entries["Date"], entries["Project"]) == ("A. Nyone", "2026-11-22", "Park")
    assert (entries["Units"], entries["Tolerance"]) == ("mm, shown to 0.1 mm", "0.5 mm")
    for sheet in sheets(made):
        texts = {text.text for text in sheet.texts}
        assert set(entries) | {"A. Nyone", "rod 2 mm"} <= texts
        assert any(text.startswith("Pavilion roof: ") for text in texts)


@pytest.mark.parametrize(
    ("joint", "words"),
    [
        (rs.Pin(eccentricity=0.008), "pin, eccentricity 8 mm"),
        (rs.Ball(), "ball"),
        (rs.Ball(mass=0.12), "ball, mass 0.12 kg"),
        (rs.Spring(shear=0.5, out_of_plane=float("inf")), "spring, shear 0.5 N m/rad, out of plane rigid"),
    ],
)
def test_joints_stand_in_the_title_block_with_their_units(joint: Joint, words: str) -> None:
    made = wished()
    made = replace(made, results=Results.of({**made.results.plain(), "joint": joint_parameters(joint)}))
    for none in (made, replace(made, case_toml="[strength]\nhole = 0.0\n")):  # as every case that has loads says
        assert dict(title_block(none, "").entries)["Joints"] == f"{words}, holes to be given"
    given = replace(made, case_toml="[strength]\nhole = 0.0085\n")
    assert dict(title_block(given, "").entries)["Joints"] == f"{words}, holes 8.5 mm"
    drilled = {text.text for sheet in sheets(given) if sheet.title.startswith("Rod strips") for text in sheet.texts}
    assert "Round marks: holes 8.5 mm." in drilled


def test_the_date_is_that_of_source_date_epoch_or_today(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    assert dict(title_block(sample_archive(3, 2), "").entries)["Date"] == "1970-01-01"
    assert dict(title_block(styled(sample_archive(3, 2), date="2026-11-22"), "").entries)["Date"] == "2026-11-22"
    for broken in ("soon", "1e400", "99999999999999999999"):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", broken)
        before = time.strftime("%Y-%m-%d", time.gmtime())
        assert (
            before
            <= dict(title_block(sample_archive(3, 2), "").entries)["Date"]
            <= time.strftime("%Y-%m-%d", time.gmtime())
        )
        assert drawings_pdf([], (210, 297), "no sheets").startswith(b"%PDF")
    assert os.environ["SOURCE_DATE_EPOCH"] == broken


def test_dates_that_are_no_days_are_refused() -> None:
    with pytest.raises(InputError, match="2026-13-01"):
        DrawingStyle(date="2026-13-01")
    with pytest.raises(InputError, match="tolerance"):
        DrawingStyle(tolerance=-1e-3)


@pytest.mark.slow
def test_long_names_are_shortened_to_their_place() -> None:
    made = hostile_archive()
    made = styled(made, **{**made.results.plain()["drawings"], "project": "W" * 500, "name": "W" * 500, "paper": "A4"})
    for sheet in sheets(made):
        for text in sheet.texts:
            if set(text.text) & {"W"} and text.layer == "TITLE":
                assert text.at[0] + LETTER * text.size * len(text.text) <= PAPERS["A4"][0] - MARGIN


def test_a_result_without_rod_or_joint_says_so() -> None:
    bare = {key: value for key, value in sample_archive(3, 2).results.plain().items() if key not in ("rod", "joint")}
    entries = dict(title_block(replace(sample_archive(3, 2), results=Results.of(bare)), "").entries)
    assert entries["Section"] == entries["Material"] == "not given"


# What tables and stages are of


@cache
def small(*ends: Ends) -> Archive:
    """A dome of seven rods each way, its four stages followed."""
    layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.015)
    return rs.find_form(rs.Hemisphere(0.2), layout, ROD, ends=ends).archive(options=rs.OutputOptions(stages=4))


def titled(made: Archive, first: str) -> list[Drawing]:
    """The sheets whose titles begin so."""
    return [sheet for sheet in sheets(made) if sheet.title.startswith(first)]


def cells(found: list[Drawing]) -> list[str]:
    return [text.text for sheet in found for text in sheet.texts if text.layer == "LABEL"]


def figures(made: Archive, table: str) -> set[str]:
    """What depends on the final shape: smallest radii of rods, lengths of diagonals [mm]."""
    if table == "Rods":
        return {f"{1e3 * (rod.min_radius or 0.0):.4g}" for rod in made.results.rods}
    fabricated = made.results.fabrication
    assert fabricated is not None
    return {rounding_of(made.results).mm(brace.final) for brace in fabricated.bracing}


def braced(*ends: Ends) -> Archive:
    """The same dome, its diagonals laths as the case has them."""
    return replace(small(*ends), case_toml='[bracing]\nkind = "laths"\n')


def test_only_shells_with_bracing_have_sheets_of_it() -> None:
    """Of cables the lengths to cut are known; the files at 1:1 have the diagonals of every shell."""
    plain = small("pinned").results.plain()
    for brace in plain["fabrication"]["bracing"]:
        brace["cut"] = brace["final"] / 1.0005
    cables = replace(small("pinned"), results=Results.of(plain))
    assert "bracing" in drawing_set(small("pinned"))
    for made, has in ((small("pinned"), False), (braced("pinned"), True), (cables, True)):
        assert any(sheet.title.startswith("Bracing") for sheet in sheets(made)) == has


@pytest.mark.parametrize("table", ["Rods", "Bracing"])
def test_tables_of_the_final_shape_say_with_which_ends_it_is(table: str) -> None:
    """A shell popped up with both ends has the table of the one that its title names: here of the clamped one."""
    named = {ends: f"{table}, final shape with {ends} ends" for ends in ENDS}
    for ends, other in (ENDS, ENDS[::-1]):
        assert titled(braced(ends), named[ends])
        assert not titled(braced(ends), named[other])
    both = [ends for ends in ENDS if titled(braced(*ENDS), named[ends])]
    assert both == ["clamped"]
    shown, of = set(cells(titled(braced(*ENDS), table))), {ends: figures(small(ends), table) for ends in ENDS}
    assert of["clamped"] <= shown
    assert not of["pinned"] - of["clamped"] <= shown


def test_the_table_of_supports_says_how_the_ends_are_held() -> None:
    held = {"pinned": "pinned ends (free to turn; directions as on the target)", "clamped": "clamped ends"}
    for ends, words in held.items():
        assert titled(small(ends), f"Supports, {words}")
    assert titled(small(*ENDS), "Supports, clamped ends (directions held)")
    assert not titled(small(*ENDS), "Supports, pinned")


def test_every_sheet_says_which_supports_its_shape_is_of() -> None:
    held = {"pinned": "pinned ends (free to turn)", "clamped": "clamped ends (directions held)"}
    for ends, words in held.items():
        for sheet in sheets(small(ends)):
            assert {text.text for text in sheet.texts} >= {"Supports", words}, sheet.title


def test_tables_of_a_shell_that_is_only_draped_name_no_ends() -> None:
    sample = sample_archive(3, 2)
    states = {name: state for name, state in sample.states.items() if "pinned" not in name and "clamped" not in name}
    known = {key: value for key, value in sample.results.plain().items() if key not in ("pop_up", "bending")}
    titles = [sheet.title for sheet in sheets(replace(sample, results=Results.of(known), states=states))]
    assert "Rods" in titles
    assert any(title == "Supports" or title.startswith("Supports, 1 of ") for title in titles)


def followed(made: Archive, first: int, **known: object) -> Archive:
    """The archive without the stages between flat and the `first` that is known."""
    plain, states = made.results.plain(), dict(made.states)
    kept = [0, *range(first, len(states["history"]))]
    stages = [plain["deployment"]["stages"][k] for k in kept]
    for name, values in made.states.items():
        if name.startswith("history"):
            states[name] = values[kept]
    deployment = {**plain["deployment"], "stages": stages, **known}
    return replace(made, results=Results.of({**plain, "deployment": deployment}), states=states)


def erection_words(made: Archive) -> tuple[str, str]:
    """Title of the sheet of erection stages, and what stands there in bold red."""
    (sheet,) = titled(made, "Erection stages")
    red = [text for text in sheet.texts if text.layer == "LABEL" and text.bold and text.colour == "#b3372c"]
    return sheet.title, " ".join(text.text for text in sorted(red, key=lambda text: -text.at[1]))


def test_the_erection_sheet_says_which_stages_are_not_known() -> None:
    """Of 1/16, 1/4, 9/16 and all of the deployment the lowest two are taken away."""
    made = small("pinned")
    assert erection_words(made) == ("Erection stages, front elevations", "")
    title, words = erection_words(followed(made, 3, lost_at=0.5625, reached_from_flat=None))
    assert title == "Erection stages, front elevations; not known below 56 %"
    assert words == "The deployment could not be followed: no stage is known between flat and 56 % of it."


def test_the_erection_sheet_says_where_the_shell_has_to_be_guided() -> None:
    made = followed(small("pinned"), 1, guided=[0.0625, 0.25], reached_from_flat=False)
    title, words = erection_words(made)
    assert title == "Erection stages, front elevations"
    assert words == "Between 6 % and 25 % it has to be guided, and its shape is not known."
    _, both = erection_words(followed(small("pinned"), 2, guided=[0.25, 0.5625], lost_at=0.25))
    assert both == (
        "The deployment could not be followed: no stage is known between flat and 25 % of it. Between 25 % and 56 % it "
        "has to be guided, and its shape is not known."
    )


@pytest.mark.slow
def test_holes_for_the_ends_of_a_model_can_be_drilled_through_its_support_plan() -> None:
    """On parts at 1:1 the circles are as far apart as the ends are [mm]."""
    made = styled(archive("dome"), paper="A4")
    shell = form("dome").popped[made.final.removeprefix("popped_")]  # type: ignore[index, union-attr]
    ends = 1e3 * shell.positions[shell.shell.mesh.ends.reshape(-1), :2]
    parts = [sheet for sheet in sheets(made) if sheet.title.startswith("Support plan 1:1, part ")]
    assert len(parts) > 4
    assert not [sheet for sheet in sheets(archive("dome")) if sheet.title.startswith("Support plan 1:1, part ")]  # A3
    met = set[int]()
    for part in parts:
        circles = np.array([mark.at for mark in part.marks])
        if len(circles) < 2:
            continue
        shifts = circles[0] - ends  # one of them puts every circle on an end
        apart = np.linalg.norm(circles[:, None, None] - (ends + shifts[:, None]), axis=-1)
        best = int(apart.min(axis=2).max(axis=0).argmin())
        assert apart[:, best].min(axis=1).max() < 0.02
        met |= set(apart[:, best].argmin(axis=1).tolist())
    assert met == set(range(len(ends)))
