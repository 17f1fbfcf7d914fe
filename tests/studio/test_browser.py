"""The studio as somebody uses it who has a keyboard and a mouse, in Chromium."""

from pathlib import Path

import pytest

from tests.output.browser import needs_browser

CASE = """
target = { kind = "hemisphere" }
layout = { spacing = "60 mm", edge = "30 mm" }
rod = { section = { radius = "1 mm" }, material = { youngs_modulus = "1 MPa" } }
pop_up = { ends = "clamped" }
checks = { stages = 0 }
"""
SPACING = "input[data-path='layout.spacing']"


@pytest.mark.slow
@needs_browser
def test_a_case_is_changed_undone_kept_refined_and_found_again_after_a_reload(tmp_path: Path) -> None:
    from tests.acceptance.studio import server
    from tests.acceptance.studio_browser import Robot, browser_page, errors

    (tmp_path / "case.toml").write_text(CASE)
    said: list[str] = []
    with server(tmp_path / "sessions", str(tmp_path / "case.toml")) as (address, _), browser_page(said) as page:
        page.set_default_timeout(20_000)
        robot = Robot(page, tmp_path, "studio")

        def figures() -> dict[str, str]:
            robot.checked()
            rows = page.locator("#figures tr").all_inner_texts()
            return dict(row.split("\t", 1) for row in rows)

        page.goto(address)
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
        assert page.evaluate("document.activeElement.dataset.path") == "layout.spacing"

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
    assert errors(said) == []
