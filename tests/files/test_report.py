"""The report: what a reader meets first, that it needs nothing else, and that it works in a browser."""

import base64
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import needs_browser, open_report
from forms import TARGETS, archive, wished
from sample_archive import sample_archive, table_archive, with_way_up

from gridshell.output.archive import export
from gridshell.output.verdict import verdict
from gridshell.output.viewer import viewer_json


def page_of(made: object, folder: Path) -> Path:
    export(made, folder, ["report"])  # type: ignore[arg-type]
    return folder / "report.html"


@needs_browser
@pytest.mark.parametrize("name", [*TARGETS, "table"])
def test_in_a_browser_the_slider_moves_the_table_sorts_and_the_console_is_silent(name: str, tmp_path: Path) -> None:
    made = table_archive() if name == "table" else archive(name)
    found, console = open_report(page_of(made, tmp_path), tmp_path)
    assert console == []
    pictures = [picture for _, picture in found["stages"]]
    captions = [caption for caption, _ in found["stages"]]
    assert len(set(captions)) == len(captions) == (2 if name == "table" else 10)
    assert len(set(pictures)) == len(pictures)  # every stage looks different
    assert captions[0] == "Flat, as cut and laid out"
    if name != "table":
        assert found["stress"] == pictures[-1] != found["gap"]
        assert found["bar"] == "stress in kPa"
    assert found["turned"] != found["stress"]
    lengths = [float(value) for value in found["up"]]
    assert lengths == sorted(lengths)
    assert [float(value) for value in found["down"]] == lengths[::-1]
    assert len(set(lengths)) > 2


@needs_browser
def test_a_60_by_60_grid_is_usable_in_a_browser(tmp_path: Path) -> None:
    page = page_of(with_way_up(sample_archive(60, 6)), tmp_path)
    found, console = open_report(page, tmp_path)
    assert console == []
    assert len({picture for _, picture in found["stages"]}) == 10


def test_frames_of_the_view_are_the_archive_s_shapes() -> None:
    """Decoded again: every frame is a shape of the archive to 16 bits, and there are no others."""
    made = archive("dome")
    data = json.loads(viewer_json(made) or "")
    nodes = made.states["rod_nodes"]
    shapes = [*made.states["history"][:-1], made.states["popped_pinned"], made.states["popped_clamped"]]
    cloud = np.concatenate([shape[nodes] for shape in shapes])
    low, size = cloud.min(axis=0), np.ptp(cloud, axis=0).max()
    assert sum(data["rods"]) == len(nodes)
    assert len(data["frames"]) == len(shapes)
    for frame, shape in zip(data["frames"], shapes, strict=True):
        places = np.frombuffer(base64.b64decode(frame["places"]), dtype="<u2").reshape(-1, 3)
        np.testing.assert_allclose(low + places / 65535 * size, shape[nodes], atol=size / 65535)
        assert ("gap" in frame) == frame["name"].startswith("popped")
        assert ("stress" in frame) == (frame["name"] != "flat")


def test_without_a_way_up_the_view_says_that_nothing_is_known_between(tmp_path: Path) -> None:
    made = sample_archive()
    page = page_of(made, tmp_path).read_text()
    assert "The way up from flat was not followed: nothing is known between these shapes." in page
    assert len(json.loads(viewer_json(made) or "")["frames"]) == 3  # flat, pinned, clamped, and nothing made up


def test_data_of_the_view_cannot_end_its_script() -> None:
    made = table_archive()
    rods = [{**rod, "id": "</script>"} for rod in made.result["rods"]]
    data = viewer_json(replace(made, result={**made.result, "rods": rods})) or ""
    assert "</" not in data


def test_warnings_of_the_way_up_come_first(tmp_path: Path) -> None:
    made = archive("dome")
    words = "between 14 % and 25 % of the way from flat the shell snaps: there it must be pushed"
    page = page_of(replace(made, result={**made.result, "warnings": [words]}), tmp_path).read_text()
    assert page.index(words) < page.index("Converged and stable") < page.index("<h2>")


def test_checks_are_in_words_and_numbers(tmp_path: Path) -> None:
    made = wished()
    page = page_of(made, tmp_path).read_text()
    share = made.result["bending"]["pinned"]["utilisation"]
    assert 0.1 < share < 1
    assert f"{100 * share:.2g} %" in page
    assert "Sum of all forces over the largest" in page
    assert "utilisation in %" in page
    assert re.search(r"<h2>Stock</h2>", page)
    assert "cut = &#34;LASER&#34;" in page


def test_report_of_60_by_60_rods_with_its_way_up_stays_below_15_megabytes(tmp_path: Path) -> None:
    page = page_of(with_way_up(sample_archive(60, 6)), tmp_path)
    assert page.stat().st_size < 15e6
    assert page_of(archive("dome"), tmp_path / "dome").stat().st_size < 5e6


@pytest.mark.parametrize(
    ("share", "headline", "words"),
    [(0.44, "Converged and stable", "The rods use 44 % of their strength at most"),
     (1.43, "Converged, but the rods would break", "The rods use 143 % of their strength at most"),
     (None, "Converged and stable", "No strength was given")],
)  # fmt: skip
def test_the_verdict_knows_the_strength(share: float | None, headline: str, words: str) -> None:
    """The worst of all shapes counts: here that of the way up."""
    made = archive("dome")
    bent = {key: dict(entry) for key, entry in made.result["bending"].items() if isinstance(entry, dict)}
    for entry in bent.values():
        entry["utilisation"] = None if share is None else 0.3
    bent["pop_up"]["utilisation"] = share
    found = verdict(replace(made, result={**made.result, "bending": bent}))
    assert found.headline == headline
    assert any(sentence.startswith(words) for sentence in found.sentences)


def test_the_verdict_calls_a_way_up_smooth_only_where_nothing_snaps() -> None:
    made = archive("dome")
    smooth = "On the way up from flat the shell moves smoothly, as far as its stages tell."
    assert smooth in verdict(made).sentences
    way = {**made.result["deployment"], "snaps": [[0.1, 0.2]]}
    assert smooth not in verdict(replace(made, result={**made.result, "deployment": way})).sentences
    assert smooth not in verdict(sample_archive()).sentences


def test_the_verdict_warns_of_a_shell_that_springs_off_with_every_support() -> None:
    made = archive("dome")
    gaps = {ends: dict(gap) for ends, gap in made.result["agreement"].items()}
    gaps["clamped"]["max_relative"] = gaps["pinned"]["max_relative"] = 0.09
    found = verdict(replace(made, result={**made.result, "agreement": gaps}))
    assert (found.level, found.headline) == ("caution", "Converged and stable, but it does not keep to the target")
    gaps["clamped"]["max_relative"] = 0.01
    assert verdict(replace(made, result={**made.result, "agreement": gaps})).level == "good"
