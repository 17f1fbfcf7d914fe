"""The studio as somebody uses it who has a keyboard and a mouse, in Chromium."""

import json
import random
import tomllib
import zlib
from base64 import urlsafe_b64decode, urlsafe_b64encode
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

from tests.output.browser import SCALE, needs_browser

if TYPE_CHECKING:
    import subprocess

    from playwright.sync_api import BrowserContext, Page

    from tests.acceptance.studio_browser import Robot

CASE = """
target = { kind = "hemisphere" }
layout = { spacing = "60 mm", edge = "30 mm" }
rod = { section = { radius = "1 mm" }, material = { youngs_modulus = "1 MPa" } }
pop_up = { ends = "clamped" }
checks = { stages = 0 }
"""
LOADED = """
loads = [{ name = "gale", kind = "wind", value = "0.4 kN/m2", coefficient = -0.5 },
         { name = "weight", kind = "self_weight" }]
combinations = [{ name = "storm", factors = { gale = 1.5, weight = 1.0 } }]
"""
SPACING = "input[data-path='layout.spacing']"
SCROLLED = "document.getElementById('result').scrollTop"
CURRENT = "#figures:not(.old)"  # the figures of a net, of the present case, before it has its verdict


class Server(NamedTuple):
    """A studio's address and process, and a browser in which its pages are opened, all in one session."""

    address: str
    process: "subprocess.Popen[str]"
    context: "BrowserContext"


class Studio(NamedTuple):
    """A page that has found `CASE`, and what its console has said."""

    page: "Page"
    robot: "Robot"
    server: Server
    said: list[str]

    def open(self, case: Any) -> None:
        """Follow a link to a case."""
        self.page.goto(f"{self.server.address}#case={code(json.dumps(case))}")

    def errors(self) -> list[str]:
        from tests.acceptance.studio_browser import errors

        return errors(self.said)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One for all tests: a server, a browser and the process of a session take longer to start than most tests."""
    from tests.acceptance.studio import server
    from tests.acceptance.studio_browser import browser_page

    with server(tmp_path_factory.mktemp("sessions")) as (address, process), browser_page([], SCALE) as page:
        yield Server(address, process, page.context)


@contextmanager
def opened(server: Server, context: "BrowserContext", folder: Path) -> Iterator[Studio]:
    from tests.acceptance.studio_browser import Robot

    page, said = context.new_page(), list[str]()
    page.set_default_timeout(60_000)
    page.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: said.append(str(error)))
    studio = Studio(page, Robot(page, folder, "studio"), server, said)
    studio.open(tomllib.loads(CASE))
    studio.robot.checked()
    yield studio
    for page in context.pages[1:]:
        page.close()


@pytest.fixture
def studio(server: Server, tmp_path: Path) -> Iterator[Studio]:
    """A page in the session of all tests: with the history and the variants of those before it."""
    with opened(server, server.context, tmp_path) as studio:
        yield studio


@pytest.fixture
def new_studio(server: Server, tmp_path: Path) -> Iterator[Studio]:
    """A page in a session of its own."""
    browser = server.context.browser
    assert browser is not None
    context = browser.new_context(viewport={"width": 1440, "height": 900}, device_scale_factor=SCALE)
    with opened(server, context, tmp_path) as studio:
        yield studio
    context.close()


def put(page: "Page", selector: str, text: str) -> None:
    """Write into a field, and leave it with Enter."""
    field = page.locator(selector).first
    field.fill(text)
    field.press("Enter")


def code(text: str) -> str:
    """What a link holds after "#case="."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    return urlsafe_b64encode(packer.compress(text.encode()) + packer.flush()).decode().rstrip("=")


def linked(page: "Page") -> Any:
    """The case in the page's address."""
    packed = page.url.partition("#case=")[2]
    return json.loads(zlib.decompress(urlsafe_b64decode(packed + "=" * (-len(packed) % 4)), -15))


@pytest.mark.slow
@needs_browser
def test_two_tabs_of_one_session_show_the_same_case_with_its_figures(tmp_path: Path, studio: Studio) -> None:
    from playwright.sync_api import expect

    from tests.acceptance.studio_browser import Robot

    first, second = studio.page, studio.page.context.new_page()
    tabs = [studio.robot, Robot(second, tmp_path, "studio")]
    second.goto(studio.server.address)
    tabs[1].checked()
    for tab, width in zip(tabs, ("70", "90"), strict=True):
        put(tab.page, SPACING, width)
        for page in (first, second):
            expect(page.locator(SPACING).first).to_have_value(width)
        tab.checked()
        for other in tabs:
            other.checked()
            assert linked(other.page)["layout"]["spacing"] == float(width) / 1000
        assert first.inner_text("#figures") == second.inner_text("#figures")
    first.click("#undo")
    expect(second.locator(SPACING).first).to_have_value("70")
    second.wait_for_selector("#redo:not(:disabled)")
    assert studio.errors() == []


@pytest.mark.slow
@needs_browser
def test_a_case_is_changed_undone_kept_refined_and_found_again_after_a_reload(new_studio: Studio) -> None:
    page, robot = new_studio.page, new_studio.robot

    def figures() -> dict[str, str]:
        robot.checked()
        rows = page.locator("#figures tr").all_inner_texts()
        return dict(row.split("\t", 1) for row in rows)

    first = figures()
    assert int(first["rods"]) > 10
    assert page.inner_text("#verdict strong")

    page.focus(SPACING)  # a number in mm, by the keyboard alone
    for _ in range(10):
        page.keyboard.press("ArrowUp")
    wider = float(page.input_value(SPACING))
    assert 60 < wider < 120
    page.keyboard.press("Enter")
    second = figures()
    assert second["all rods together"] != first["all rods together"]
    page.wait_for_selector(f"{SPACING}:focus")

    assert not page.is_disabled("#undo")
    page.keyboard.press("Control+z")
    page.wait_for_selector("#undo:disabled")
    assert figures() == first
    assert float(page.input_value(SPACING)) == 60
    page.click("#redo")
    page.wait_for_selector("#redo:disabled")
    assert figures() == second
    robot.keep("wider")

    page.focus("#refine")
    page.keyboard.press("Enter")
    page.wait_for_selector("#refine[aria-pressed=true]")
    refined = figures()
    (gain,) = (value for name, value in refined.items() if name.startswith("refined (taper)"))
    assert gain.endswith("after") or "refused" in refined
    robot.keep("refined")

    page.reload()
    page.wait_for_selector("#refine[aria-pressed=true]")
    assert figures() == refined
    assert page.locator("#variants li span").all_inner_texts() == ["wider", "refined"]
    assert not page.is_disabled("#undo")
    assert new_studio.errors() == []


@pytest.mark.slow
@needs_browser
def test_a_change_made_while_the_server_is_away_is_kept(tmp_path: Path, new_studio: Studio) -> None:
    from playwright.sync_api import expect

    from tests.acceptance.studio import server

    (tmp_path / "case.toml").write_text(CASE)
    options = (tmp_path / "sessions", str(tmp_path / "case.toml"))
    page, robot = new_studio.page, new_studio.robot
    with server(*options) as (address, _):
        page.goto(address)
        robot.checked()
    page.wait_for_selector("#state.wrong")
    put(page, SPACING, "80")
    with server(*options, "--port", address.rstrip("/").rpartition(":")[2]):
        robot.checked()
        expect(page.locator(SPACING).first).to_have_value("80")
        assert linked(page)["layout"]["spacing"] == 0.08
        assert not page.is_disabled("#undo")


@pytest.mark.slow
@needs_browser
def test_a_page_comes_in_by_its_token_and_stays_in_when_the_server_is_started_again(
    tmp_path: Path, new_studio: Studio
) -> None:
    from playwright.sync_api import expect

    from tests.acceptance.studio import server

    (tmp_path / "case.toml").write_text(CASE)
    options = (tmp_path / "sessions", str(tmp_path / "case.toml"))
    page, robot = new_studio.page, new_studio.robot
    with server(*options, token=True) as (address, _):
        plain = address.partition("?")[0]
        page.goto(plain)
        expect(page.locator("#notice")).to_contain_text("needs its token: open the address that it printed")
        page.goto(address)
        robot.checked()
        assert "token" not in page.url
    page.wait_for_selector("#state.wrong")
    put(page, SPACING, "80")
    with server(*options, "--port", plain.rstrip("/").rpartition(":")[2], token=True) as (again, _):
        assert again != address
        robot.checked()
        expect(page.locator(SPACING).first).to_have_value("80")
        page.goto(
            "data:text/html,<a href='" + plain + "'>from elsewhere</a>"
        )  # a cookie for this site alone stays away
        page.click("a")
        robot.checked()
        expect(page.locator(SPACING).first).to_have_value("80")
        page.context.clear_cookies()
        with server(tmp_path / "other", token=True) as (other, _):
            page.goto(plain)
            expect(page.locator("#notice")).to_contain_text("needs its token")
            page.goto(other.partition("?")[0])
            expect(page.locator("#notice")).to_contain_text("needs its token")


@pytest.mark.slow
@needs_browser
def test_a_link_may_be_long_and_one_that_holds_too_much_says_so(studio: Studio) -> None:
    from playwright.sync_api import expect

    page, robot = studio.page, studio.robot
    case = linked(page)
    bomb = code('{"target": "' + 60_000_000 * "x" + '"}')
    assert 50_000 < len(bomb) < 100_000
    deep = code('{"target":' * 400_000 + "1" + "}" * 400_000)
    for wrong in (bomb, deep, code(json.dumps({**case, "drawings": {"project": 1_500_000 * "x"}}))):
        page.goto("about:blank")
        page.goto(f"{studio.server.address}#case={wrong}")
        expect(page.locator("#notice")).to_contain_text("holds more than the studio reads")
        robot.checked()
    text = random.Random(1).randbytes(240_000).hex()
    studio.open({**case, "drawings": {"project": text}})
    robot.checked()
    assert linked(page)["drawings"]["project"] == text
    put(page, SPACING, "90")
    robot.checked()
    studio.open(
        {**case, "loads": [{"name": 240_000 * "x", "factors": 30 * [[[[[[[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]]]]]]}]}
    )
    expect(page.locator("#verdict.failed")).to_contain_text("at most 20 tables and lists within one another")
    assert studio.errors() == []


@pytest.mark.slow
@needs_browser
def test_a_page_whose_session_is_lost_begins_another(tmp_path: Path, new_studio: Studio) -> None:
    from tests.acceptance.studio import server

    (tmp_path / "case.toml").write_text(CASE)
    options = (tmp_path / "kept", str(tmp_path / "case.toml"))
    page, robot = new_studio.page, new_studio.robot
    with server(*options) as (address, _):
        page.goto(address)
        robot.checked()
        first = page.evaluate("localStorage.getItem('rodshell-session')")
    (tmp_path / "kept" / "sessions" / first / "session.json").write_text("[")
    put(page, SPACING, "80")
    with server(*options, "--port", address.rstrip("/").rpartition(":")[2]):
        page.wait_for_function("first => localStorage.getItem('rodshell-session') !== first", arg=first)
        robot.checked()
        assert linked(page)["layout"]["spacing"] == 0.08


@pytest.mark.slow
@needs_browser
def test_a_case_that_failed_offers_no_files_and_no_script_of_the_case_before(studio: Studio) -> None:
    from playwright.sync_api import expect

    page, robot = studio.page, studio.robot
    offered = [page.locator(part) for part in ("#download[href]", "#python:enabled", "#keep button:enabled")]
    for part in offered:
        expect(part).to_have_count(1)
    page.locator(".lil-title", has_text="Lattice").click()
    page.set_viewport_size({"width": 1440, "height": 400})
    page.locator("#compare").scroll_into_view_if_needed()
    assert page.evaluate(SCROLLED) > 0
    put(page, "[data-path='layout.spacing'] >> nth=-1", "banana")
    page.wait_for_selector("#verdict.failed")
    assert page.evaluate(SCROLLED) == 0  # the sentence is in sight
    for part in offered:
        expect(part).to_have_count(0)
    page.click("#undo")
    robot.checked()
    for part in offered:
        expect(part).to_have_count(1)
    page.fill("#name", "   ")
    page.click("#keep button")
    expect(page.locator("#state.wrong")).to_have_text("a variant needs a name")
    assert page.locator("#verdict.failed, #verdict.old, body.old").count() == 0


@pytest.mark.slow
@needs_browser
def test_a_link_opens_its_case_in_an_open_tab_and_one_without_a_case_says_so(studio: Studio) -> None:
    from playwright.sync_api import expect

    page, robot = studio.page, studio.robot
    case = linked(page)
    case["layout"]["spacing"] = 0.08
    whole = code(json.dumps(case))
    page.goto(f"{studio.server.address}#case={whole}")  # the page stays: only what follows the # differs
    expect(page.locator(SPACING).first).to_have_value("80")
    robot.checked()
    for wrong in (whole[:-9], whole[:20] + "!" + whole[21:], "", *map(code, ("5", '"x"', "null", "[]", "{"))):
        for open_tab in (True, False):
            if not open_tab:
                page.goto("about:blank")
            page.goto(f"{studio.server.address}#case={wrong}")
            expect(page.locator("#notice")).to_contain_text("holds no case, or is damaged or cut off")
            expect(page.locator(SPACING).first).to_have_value("80")
            robot.checked()
    put(page, SPACING, "90")
    expect(page.locator("#notice")).to_be_hidden()
    assert studio.errors() == []


@pytest.mark.slow
@needs_browser
def test_the_dialog_of_loads_keeps_those_that_the_case_has(studio: Studio) -> None:
    page = studio.page
    studio.open(tomllib.loads(CASE + LOADED))
    page.wait_for_selector("#loads[aria-pressed=true]")
    page.click("#loads")
    assert page.input_value("input[name=snow]") == ""
    assert "gale (wind)" in page.inner_text("#other-loads")
    assert "1.5 \u00d7 gale" in page.inner_text("#combined")
    page.fill("input[name=snow]", "0.3 kN/m2")
    page.fill("input[name=self_weight]", "2 kg/m2")
    page.click("#load-values button[value=check]")
    page.click("#loads")
    case = linked(page)
    assert [load["name"] for load in case["loads"]] == ["gale", "weight", "snow"]
    assert case["loads"][0]["kind"] == "wind"
    assert case["loads"][1]["cladding"] == "2 kg/m2"
    assert case["loads"][2] == {"name": "snow", "kind": "snow", "value": "0.3 kN/m2"}
    storm = {"name": "storm", "factors": {"gale": 1.5, "weight": 1.0}}
    assert case["combinations"] == [storm, {"name": "winter", "factors": {"weight": 1.35, "snow": 1.5}}]
    page.fill("input[name=snow]", "")
    page.click("#load-values button[value=check]")
    page.click("#loads")
    assert linked(page)["combinations"] == [storm]
    assert studio.errors() == []


@pytest.mark.slow
@needs_browser
def test_a_wrong_load_is_named_as_it_is_counted_and_its_button_leads_to_it(studio: Studio) -> None:
    from playwright.sync_api import expect

    page = studio.page
    case = linked(page)
    weight = {"name": "own", "kind": "self_weight"}
    for loads, sentence, focused in (
        (
            [weight, {"name": "ice", "kind": "snow", "value": "thick"}],
            'value of load 2 ("ice")',
            "input[name=snow]",
        ),
        ([weight, {"name": "gale", "kind": "wind", "value": "much"}], 'of load 2 ("gale")', "#other-loads button"),
    ):
        link = {
            **case,
            "loads": loads,
            "combinations": [{"name": "all", "factors": {"own": 1, loads[1]["name"]: 1}}],
        }
        studio.open(link)
        expect(page.locator("#verdict.failed strong")).to_contain_text(sentence)
        page.get_by_role("button", name="Go to load 2").click()
        expect(page.locator(f"#load-values[open] {focused}")).to_be_focused()
        if focused.startswith("input"):
            page.keyboard.press("Escape")
    page.keyboard.press("Enter")  # on the button that removes the gale
    page.fill("input[name=snow]", "")
    page.click("#load-values button[value=check]")
    page.wait_for_selector("#verdict:not(.failed):not(.old)")
    assert [load["name"] for load in linked(page)["loads"]] == ["own"]
    assert linked(page)["combinations"] == [{"name": "all", "factors": {"own": 1}}]
    link = {**case, "layout": {"spacing": "wide"}, "loads": [], "combinations": []}
    studio.open(link)
    page.get_by_role("button", name="Go to layout.spacing").click()
    expect(page.locator("[data-path='layout.spacing']").last).to_be_focused()
    studio.open({**case, "drape": {"gravity": 5}})  # whose sentence names drape.method too
    page.get_by_role("button", name="Go to drape.gravity").click()
    expect(page.locator("[data-path='drape.gravity']")).to_be_focused()
    assert studio.errors() == []


@pytest.mark.slow
@needs_browser
def test_the_dialog_of_loads_opens_whatever_a_case_has_in_their_place(studio: Studio) -> None:
    from playwright.sync_api import expect

    page = studio.page
    case = linked(page)
    for loads in (5, "gale", {"gale": 1}, [5, {"kind": 3}], [None]):
        studio.open({**case, "loads": loads, "combinations": loads})
        expect(page.locator("#loads")).to_have_attribute("aria-pressed", "true")
        page.wait_for_selector("#verdict.failed:not(.old)")
        page.click("#loads")
        page.wait_for_selector("#load-values[open]")
        expect(page.locator("#unread-loads")).to_contain_text("cannot be read")
        for button in page.locator("#kept-loads button").all()[::-1]:
            button.click()
        page.fill("input[name=snow]", "0.3 kN/m2")
        page.click("#load-values button[value=check]")
        page.wait_for_selector("#verdict:not(.failed):not(.old)")
        assert {load["kind"] for load in linked(page)["loads"]} == {"snow", "self_weight"}
        assert [row["name"] for row in linked(page)["combinations"]] == ["permanent", "winter"]
    assert studio.errors() == []


@pytest.mark.slow
@needs_browser
def test_an_outline_ends_the_target_that_there_is_and_a_new_state_of_a_mesh_keeps_the_case(
    tmp_path: Path, studio: Studio
) -> None:
    import ezdxf
    import numpy as np
    from playwright.sync_api import expect

    from tests.acceptance.targets_broken import as_obj, dome

    def outline(radius: float) -> Any:
        drawing, angle = ezdxf.new(), np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)  # type: ignore[attr-defined]
        points = [radius * np.cos(angle), radius * np.sin(angle), np.full(60, 4.0 - 0.16 * radius**2)]
        drawing.modelspace().add_polyline3d(np.column_stack(points).tolist(), close=True)
        return drawing

    outline(3.0).saveas(tmp_path / "edge.dxf")
    (tmp_path / "roof.obj").write_bytes(as_obj(*dome()))
    page, robot = studio.page, studio.robot
    before = linked(page)
    expect(page.locator("#outline")).to_be_hidden()
    page.set_input_files("#file", tmp_path / "edge.dxf")  # as if it was dropped: a dome has its own edge
    expect(page.locator("#state.wrong")).to_contain_text("upload the surface first")
    page.route("**/uploads*", lambda route: route.abort(), times=1)
    page.set_input_files("#file", tmp_path / "roof.obj")
    expect(page.locator("#state.wrong")).to_contain_text("roof.obj was not sent, since the connection")
    assert linked(page) == before
    page.set_input_files("#file", tmp_path / "roof.obj")
    page.get_by_role("button", name="Go to target.unit").click()
    page.keyboard.type("m")
    page.keyboard.press("Enter")
    expect(page.locator(SPACING)).to_have_count(1)  # in the folder of the layout: no slider with the dome's spacing
    slider = f".lil-slider + {SPACING}"
    page.wait_for_selector(slider)
    assert len(page.input_value(slider)) <= 5  # mm, of a chosen spacing: four digits say enough
    put(page, slider, "1000")
    page.wait_for_selector(CURRENT)
    rods = page.inner_text("#figures td >> nth=1")
    page.set_input_files("#file", tmp_path / "edge.dxf")
    page.wait_for_selector("#no-outline:not([hidden])")
    page.wait_for_selector(CURRENT)
    assert page.inner_text("#no-outline").startswith("edge.dxf")
    assert linked(page)["target"] == {
        "kind": "mesh", "file": "upload:roof.obj", "unit": "m", "boundary": "upload:edge.dxf"
    }  # fmt: skip
    assert linked(page)["layout"] == {"spacing": 1}
    smaller = page.inner_text("#figures td >> nth=1")
    assert float(smaller.split()[0]) < 0.6 * float(rods.split()[0])
    outline(2.0).saveas(tmp_path / "edge.dxf")
    page.set_input_files("#outline-file", tmp_path / "edge.dxf")  # a new state of the same file
    page.wait_for_selector("#figures.old")
    page.wait_for_selector(CURRENT)
    assert float(page.inner_text("#figures td >> nth=1").split()[0]) < 0.6 * float(smaller.split()[0])
    page.click("#no-outline")
    page.wait_for_selector("#no-outline", state="hidden")
    page.wait_for_selector(CURRENT)
    assert page.inner_text("#figures td >> nth=1") == rods
    points, faces = dome()
    (tmp_path / "roof.obj").write_bytes(as_obj(0.8 * points, faces))
    page.set_input_files("#file", tmp_path / "roof.obj")
    page.wait_for_selector("#figures.old")
    robot.checked()
    assert linked(page)["layout"] == {"spacing": 1}
    assert float(page.inner_text("#figures td >> nth=1").split()[0]) < 0.8 * float(rods.split()[0])
    assert [error for error in studio.errors() if "ERR_FAILED" not in error] == []  # but of the upload that failed


@pytest.mark.slow
@needs_browser
def test_what_is_shown_is_marked_as_out_of_date_before_the_server_answers(studio: Studio) -> None:
    import signal

    from playwright.sync_api import expect

    page = studio.page
    parts = {name: page.locator(name) for name in ("#figures", "#view", "#plan", "#verdict")}
    for part in parts.values():
        expect(part).to_have_css("opacity", "1")
    slider = page.locator(".lil-controller", has_text="Spacing").locator(".lil-slider").bounding_box()
    assert slider is not None
    studio.server.process.send_signal(signal.SIGSTOP)
    try:
        page.mouse.move(slider["x"] + 0.6 * slider["width"], slider["y"] + 0.5 * slider["height"])
        page.mouse.down()  # shapes follow the hand: they are not marked
        expect(parts["#verdict"]).not_to_have_css("opacity", "1")
        for name in ("#view", "#plan"):
            expect(parts[name]).to_have_css("opacity", "1")
        page.mouse.up()
        put(page, SPACING, "80")
        for part in parts.values():
            expect(part).not_to_have_css("opacity", "1")
    finally:
        studio.server.process.send_signal(signal.SIGCONT)
    studio.robot.checked()
    for part in parts.values():
        expect(part).to_have_css("opacity", "1")


@pytest.mark.slow
@needs_browser
def test_a_variant_is_listed_in_every_tab_at_once_and_those_that_are_ticked_stay_so(
    tmp_path: Path, new_studio: Studio
) -> None:
    from playwright.sync_api import expect

    from tests.acceptance.studio_browser import Robot

    first = new_studio.page
    first.context.add_init_script("Math.random = () => 0.5")  # chance tells no tab from another
    first.reload()
    second = first.context.new_page()
    second.goto(new_studio.server.address)
    for page in (second, first):
        Robot(page, tmp_path, "studio").checked()
    names = second.locator("#variants li span")
    new_studio.robot.keep("one")
    expect(names).to_have_text(["one"])
    second.check("#variants input[value=one]")
    new_studio.robot.keep("two")
    expect(names).to_have_text(["one", "two"])
    expect(second.locator("#variants input[value=one]")).to_be_checked()
    second.get_by_role("button", name="Forget two").click()
    expect(first.locator("#variants li span")).to_have_text(["one"])
    assert new_studio.errors() == []


@pytest.mark.slow
@needs_browser
def test_controls_are_made_once_for_a_change_and_then_left_alone(studio: Studio) -> None:
    page, robot = studio.page, studio.robot
    put(page, SPACING, "80")
    robot.checked()
    page.wait_for_selector(f"{SPACING}:focus")
    page.wait_for_timeout(300)  # ms, in which they may be made for the verdict
    made = page.get_attribute(SPACING, "aria-labelledby")  # counts up with each control that is made
    page.wait_for_timeout(500)
    assert page.get_attribute(SPACING, "aria-labelledby") == made


@pytest.mark.slow
@needs_browser
def test_a_mesh_without_a_unit_closed_or_with_y_upwards_becomes_a_target_by_buttons(
    tmp_path: Path, studio: Studio
) -> None:
    import numpy as np

    from tests.acceptance.targets_broken import as_obj, dome

    points, faces = dome()
    polar, azimuth = np.pi * np.sqrt(1.0 - points[:, 2] / 4.0), np.arctan2(points[:, 1], points[:, 0])
    ball = np.column_stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
    (tmp_path / "ball.obj").write_bytes(as_obj(1000.0 * (5.0 * ball + [0.0, 0.0, 1.0]), faces))
    (tmp_path / "upwards.obj").write_bytes(as_obj(points[:, [0, 2, 1]] * [1.0, 1.0, -1.0], faces))
    (tmp_path / "roof.obj").write_bytes(as_obj(points, faces))
    page, robot = studio.page, studio.robot
    (tmp_path / "hill.csv").write_text("x,y,z\n0,0,0\n1,0,0\n0,1,0\n1,1,0\n")
    page.set_input_files("#file", tmp_path / "hill.csv")
    page.wait_for_selector("#outline:not([hidden])")
    assert page.is_hidden("#upright")  # heights are above a plan
    (tmp_path / "small.obj").write_bytes(as_obj(0.05 * points, faces))
    for name, units in (("small", "cm m in ft"), ("ball", "mm cm in")):  # a shell is 1 mm to 1 km wide
        page.set_input_files("#file", tmp_path / f"{name}.obj")
        page.wait_for_selector(f"#verdict.failed:has-text('{name}.obj')")
        offered = page.locator("#verdict button", has_text="\u00d7").all_inner_texts()
        assert [text.partition(":")[0] for text in offered] == units.split()
    page.get_by_role("button", name="mm: 9.93 \u00d7 9.93 \u00d7 10 m", exact=True).click()
    page.get_by_role("button", name="End it at half its height, z = 1 m").click()
    robot.checked()
    assert linked(page)["target"] == {"kind": "mesh", "file": "upload:ball.obj", "unit": "mm", "base": 1}
    assert page.locator("#verdict.failed").count() == 0
    totals = []
    for name in ("roof", "upwards"):
        page.set_input_files("#file", tmp_path / f"{name}.obj")
        page.get_by_role("button", name="m: 10 \u00d7", exact=False).last.click()
        if name == "upwards":
            page.locator("#verdict.failed button", has_text="y is up").click()  # of the sentence that asks
            page.wait_for_selector("#upright[aria-pressed=true]")
        page.wait_for_selector(CURRENT)
        assert page.inner_text("#controls .lil-title >> nth=0").endswith(f"Case of {name}.obj")
        assert linked(page)["target"].get("up") == ("y" if name == "upwards" else None)
        totals.append(float(page.inner_text("#figures td >> nth=1").split()[0]))
    assert totals[1] == pytest.approx(totals[0], rel=0.01)  # the same surface, its net from another heading
    assert studio.errors() == []


@pytest.mark.slow
@needs_browser
def test_the_verdict_is_on_the_first_screen_of_a_tablet_or_a_phone(studio: Studio) -> None:
    from playwright.sync_api import expect

    page, robot = studio.page, studio.robot
    for width, height in ((1024, 768), (420, 800), (360, 740)):
        page.set_viewport_size({"width": width, "height": height})
        page.wait_for_selector("#view .label:visible")
        edge = "label => { label.style.left = '100%'; return document.documentElement.scrollWidth }"
        assert page.locator("#view .label").evaluate(edge) == width  # where the label was before the view shrank
        parts = ("#verdict strong", "#controls", "#view canvas", "#plan")
        verdict, controls, view, plan = [box for part in parts if (box := page.locator(part).bounding_box())]
        assert verdict["y"] < height - 40  # its first words, which go on for lines on a phone
        if width == 1024:
            assert controls["x"] < view["x"] < verdict["x"]
        else:
            assert view["y"] < verdict["y"] < plan["y"] < controls["y"]
            assert view["height"] < 0.5 * height  # a finger beside it scrolls the page
    for name in ("one", "two"):
        robot.keep(name)
        page.check(f"#variants input[value={name}]")
    page.click("#compare")
    page.wait_for_selector("#side .both section:nth-child(2) canvas")
    page.wait_for_selector("#side tbody tr")
    expect(page.locator("#side > button")).to_be_in_viewport()  # before its figures are scrolled through
    assert page.evaluate("(part => part.scrollWidth - part.clientWidth)(document.getElementById('side'))") <= 0


@pytest.mark.slow
@needs_browser
def test_a_load_needs_its_unit_and_what_failed_is_not_said_while_its_remedy_is_tried(
    tmp_path: Path, studio: Studio
) -> None:
    import signal

    from playwright.sync_api import expect

    from tests.acceptance.targets_broken import as_obj, dome

    (tmp_path / "roof.obj").write_bytes(as_obj(*dome()))
    page = studio.page
    page.click("#loads")
    page.fill("input[name=snow]", "0.7")  # of what?
    page.click("#load-values button[value=check]")
    expect(page.locator("#load-values[open] input[name=snow]:invalid")).to_be_focused()
    page.click("#load-values button[value=close]")
    expect(page.locator("#load-values")).to_be_hidden()
    assert "loads" not in linked(page)
    page.set_input_files("#file", tmp_path / "roof.obj")
    page.wait_for_selector("#verdict.failed:not(.old)")
    studio.server.process.send_signal(signal.SIGSTOP)
    try:
        page.get_by_role("button", name="mm: 0.01").click()
        expect(page.locator("#verdict")).to_have_text("Looking for the form")
    finally:
        studio.server.process.send_signal(signal.SIGCONT)
    studio.robot.checked()
