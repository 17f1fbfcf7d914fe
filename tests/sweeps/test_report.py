"""The report of a search, opened in a browser: its front against front.csv, and where its points lead."""

import csv
import json
import shlex
from pathlib import Path

import pytest

import rodshell as rs
from rodshell.case.link import studio_link
from rodshell.sweeps.plan import read_plan
from rodshell.sweeps.report import _with_values
from tests.output.browser import CHROMIUM, browser_options, needs_browser
from tests.sweeps.test_search import plan
from tests.sweeps.test_sweep import BASE

FRONT = """() => {
  const drawn = document.getElementById("plane").data.find(trace => trace.name === "front");
  document.getElementById("plane").emit("plotly_click", {points: [{customdata: drawn.customdata.at(-1)}]});
  const parallel = document.getElementById("lines").data[0].dimensions.map(({label}) => label.replaceAll("<br>", ""));
  return [drawn.x, drawn.y, drawn.customdata, parallel];
}"""


@pytest.mark.slow
@needs_browser
def test_points_of_a_search_open_their_report_or_the_studio_and_the_front_is_that_of_the_search(tmp_path: Path):
    from playwright.sync_api import sync_playwright

    wanted = {"minimise": ["rms_pinned"], "maximise": ["total_length"]}
    few = {"population": 6, "generations": 1, "seed": 3}
    search = plan(objectives=wanted, constraints={"total_length": {"max": 5.5}}, search=few)
    found = rs.optimise(search, tmp_path / "out", report=True)
    assert 0 < found.feasible < found.designs
    said = list[str]()
    with sync_playwright() as play:
        options = [
            option for option in browser_options(tmp_path) if "user-data" not in option and "virtual" not in option
        ]
        browser = play.chromium.launch(executable_path=CHROMIUM, args=options)
        page = browser.new_page()
        page.set_default_timeout(120_000)  # ms
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: said.append(request.url) if request.url.startswith("http") else None)
        page.goto((tmp_path / "out" / "report.html").as_uri())
        page.wait_for_selector("#plane .points")
        x, y, designs, parallel = page.evaluate(FRONT)
        reports = page.locator("#design a", has_text="Open its report").count()
        studio = page.locator("#design a", has_text="Open in the studio").get_attribute("href")
        first, others = page.evaluate("[designs.reports, designs.studio]")
        browser.close()
    assert said == []
    with (tmp_path / "out" / "front.csv").open() as stream:
        front = list(csv.DictReader(stream))
    assert [[row["rms_pinned"], row["total_length"]] for row in front] == [
        [str(mine), str(other)] for mine, other in zip(x, y, strict=True)
    ]
    assert "layout.spacing" in parallel
    assert reports == 1
    table = rs.read_sweep(tmp_path / "out").to_pylist()
    last = {key: table[designs[-1]][key] for key in ("layout.spacing", "layout.edge")}
    rods = json.loads(table[designs[-1]]["layout.rods"])
    assert studio == studio_link(rs.Job.load(BASE, last | {"layout.rods": rods}).case)
    assert all(first[k] for k in designs)
    assert None in first
    assert None not in others


GROUPS = """() => {
  const colour = document.getElementById("colour");
  colour.value = "layout";
  colour.dispatchEvent(new Event("change"));
  return document.getElementById("plane").data.map(trace => [trace.name, trace.x.length]);
}"""


@pytest.mark.slow
@needs_browser
def test_designs_are_coloured_by_their_lattice(tmp_path: Path):
    from playwright.sync_api import sync_playwright

    lattices = [{"kind": "geodesic"}, {"kind": "geodesic", "families": 3}]
    base = {"target": {"kind": "cap", "radius": 2.0, "base": 1.6}, "layout": {"spacing": 0.4}, "joint": {"kind": "pin"}}
    lath = {"section": {"kind": "rectangle", "width": 0.002, "height": 0.02}, "material": {"preset": "gfrp"}}
    job = rs.Job.load(base | {"rod": lath, "pop_up": {"ends": "pinned"}})
    axes = {"layout": lattices, "rod.section.height": [0.01, 0.02]}
    columns = ["flat_state.lies_flat"]
    plan = {"base": job, "axes": axes, "columns": columns, "run": {"until": "pop-up"}}
    rs.sweep(plan, tmp_path / "out", report=True)
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page()
        page.goto((tmp_path / "out" / "report.html").as_uri())
        page.wait_for_selector("#plane .points")
        assert page.evaluate(GROUPS) == [[json.dumps(lattice), 2] for lattice in lattices]
        browser.close()
    flat = [row["flat_state.lies_flat"] for row in rs.read_sweep(tmp_path / "out", columns).to_pylist()]
    assert flat == [True, False, False, False]


def test_the_studio_is_started_with_the_file_that_the_designs_need(tmp_path: Path):
    (tmp_path / "a.obj").write_text("v 0 0 0\n")
    (tmp_path / "my roof.toml").write_text('[target]\nkind = "mesh"\nfile = "a.obj"\n')
    axes = {"layout.spacing": ["0.8 m", "0.9 m"]}
    (tmp_path / "sweep.toml").write_text('base = "my roof.toml"\n[axes]\n"layout.spacing" = ["0.8 m", "0.9 m"]\n')
    command = read_plan(tmp_path / "sweep.toml").origin.studio_command
    assert shlex.split(command) == ["rodshell", "studio", str(tmp_path / "my roof.toml")]
    assert read_plan({"base": "hemisphere", "axes": axes}).origin.studio_command == "rodshell studio"


@pytest.mark.parametrize(
    ("first", "shown"),
    [(("n", "rms_pinned"), ["n", "rms_clamped"]), (("n", "rms_clamped"), ["n", "rms_clamped"]),
     (("rms_pinned", "rms_given"), ["rms_clamped", "total_length"])],
)  # fmt: skip
def test_a_page_opens_on_columns_that_have_values(first: tuple[str, str], shown: list[str]) -> None:
    columns = {
        "n": [1, 2], "verdict": ["good", "good"], "rms_pinned": [None, None], "rms_clamped": [None, 0.1],
        "rms_given": [None, None], "total_length": [3.0, 4.0],
    }  # fmt: skip
    assert _with_values(first, columns) == shown
