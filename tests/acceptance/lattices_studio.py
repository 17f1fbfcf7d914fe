"""Rows of a geodesic shell made in the studio by a robot: its files measured against its result.json."""

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import ZipFile

import numpy as np

from rodshell.results import read
from rodshell.results.wording import millimetres, rounding_of
from tests.acceptance.rows import FOLDER, Row
from tests.acceptance.studio import server
from tests.acceptance.studio_browser import Robot, browser_page, errors
from tests.output.dxf_reader import Entity, read_dxf


def studio_rows() -> Iterator[Row]:
    """The first control of the studio's first page is set to geodesic; what its form is downloaded as."""
    said: list[str] = []
    with TemporaryDirectory() as name, browser_page(said) as page:
        folder = Path(name)
        with server(folder / "sessions") as (address, _):
            robot = Robot(page, FOLDER / "studio", "geodesic")
            page.goto(address)
            robot.checked()
            first = page.locator("#controls .lil-children .lil-children > *").first.get_attribute("class")
            yield Row("geodesic shell in the studio", "first control is not the lattice", float(first != "lattices"), 0)
            page.get_by_role("button", name="Geodesic", exact=True).click()
            page.wait_for_selector("#verdict.old")
            robot.checked()
            robot.picture("found")
            page.select_option("#view select.colours", "none")
            page.wait_for_selector("#view .families:not([hidden])")
            named = page.locator("#view .families span").all_inner_texts()
            with page.expect_download() as download:
                page.click("#download")
            download.value.save_as(folder / "files.zip")
            ZipFile(folder / "files.zip").extractall(folder)
            page.goto((folder / "report.html").as_uri())
        page.wait_for_selector("#view canvas")
        page.screenshot(path=FOLDER / "studio" / "geodesic_report.png")
        archive, words = read(folder), page.inner_text("body")
        families = {f"family {rod.family.upper()}" for rod in archive.results.rods if rod.family}
        unnamed = families ^ {name.strip() for name in named}
        yield Row("", "families that the view's legend does not name", len(unnamed), 0, note=", ".join(named))
        gaps = [
            millimetres(gap.max, rounding=rounding_of(archive.results)) for gap in archive.results.agreement.values()
        ]
        missing = [gap for gap in gaps if gap not in words]
        yield Row("", "gaps that its report does not say", len(missing), 0, note=", ".join(gaps))
        yield from strip_rows(archive.results.plain(), folder)
    wrong = errors(said)
    yield Row("", "errors in the console", len(wrong), 0, note="; ".join(wrong)[:200])


def strip_rows(result: dict[str, Any], folder: Path) -> Iterator[Row]:
    """Lengths of strips and places of their holes, in DXF and the schedule, against result.json."""
    strips = read_dxf(folder / "drawings/strips.dxf")
    cuts = [one.points for one in strips if one.layer == "CUT"]
    rows = list(csv.DictReader(io.StringIO((folder / "schedule/rods.csv").read_text(encoding="utf-8"))))
    long, holes, count = 0.0, 0.0, 0
    for rod, cut, row in zip(result["rods"], cuts, rows, strict=True):
        drawn, listed = float(np.linalg.norm(cut[1] - cut[0])), float(row["cut_length_mm"])
        long = max(long, abs(1e3 * rod["cut_length"] - drawn), abs(1e3 * rod["cut_length"] - listed) - 0.5)
        wanted = 1e3 * np.sort([joint["at"] for joint in rod["joints"]])
        marked, told = _marks(strips, cut), [float(one.split()[1]) for one in row["joints_from_cut_end_mm"].split(";")]
        holes = max(holes, np.abs(marked - wanted).max(), np.abs(np.sort(told) - wanted).max() - 0.5)
        count += len(wanted)
    kind = result["layout"]["kind"]
    yield Row("", "lattice of result.json is another", float(kind != "geodesic"), 0, note=kind)
    yield Row("", "cut lengths in DXF and schedule, apart", long, 0.01, "mm", f"{len(cuts)} rods, listed to 1 mm")
    yield Row("", "holes in DXF and schedule, apart", holes, 0.01, "mm", f"{count} holes, listed to 1 mm")


def _marks(strips: list[Entity], cut: np.ndarray) -> np.ndarray:
    """Distances of the marks on a strip from its start [mm]."""
    marks = np.array([one.points[0] for one in strips if one.kind == "CIRCLE" and one.layer == "MARK"])
    along = (cut[1] - cut[0]) / np.linalg.norm(cut[1] - cut[0])
    off = (marks - cut[0]) @ np.array([-along[1], along[0]])
    return np.sort((marks[np.abs(off) < 1e-3] - cut[0]) @ along)
