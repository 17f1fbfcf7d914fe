"""Links that open a case in the studio: what is in them, and what they cannot hold."""

import json
import zlib
from base64 import urlsafe_b64decode
from pathlib import Path
from typing import Any

import pytest

import rodshell as rs
from rodshell.case.link import page_case, studio_link
from rodshell.errors import InputError

CASES: dict[str, dict[str, Any]] = {
    "nothing": {},
    "another target": {"target": {"kind": "cap", "radius": "2 m"}},
    "kinds": {
        "target": {"kind": "paraboloid", "radius": "2 m", "height": "700 mm"},
        "rod": {"section": {"kind": "tube", "radius": "20 mm", "thickness": "3 mm"}, "material": {"preset": "gfrp"}},
        "joint": {"kind": "pin"},
        "bracing": {"kind": "cables", "section": {"radius": "2 mm"}, "material": {"youngs_modulus": "160 GPa"}},
    },
    "loads": {
        "target": {"kind": "hemisphere", "radius": "3 m"},
        "loads": [
            {"name": "own", "kind": "self_weight"},
            {"name": "snow", "kind": "snow", "value": "0.5 kN/m2"},
        ],
        "combinations": [{"name": "both", "factors": {"own": 1.35, "snow": 1.5}}],
    },
    "searched": {"layout": {"rotate": "auto", "left_out": ["U01", "V02"]}, "refine": {"vary": ["taper"]}},
}


def unpacked(link: str) -> dict[str, Any]:
    """The case in a link, read as the page reads it."""
    code = link.partition("#case=")[2]
    found: dict[str, Any] = json.loads(zlib.decompress(urlsafe_b64decode(code + "=" * (-len(code) % 4)), -15))
    return found


@pytest.mark.parametrize("name", CASES)
def test_a_link_gives_the_case_again(name: str) -> None:
    job = rs.Job.load(CASES[name])
    link = studio_link(job.case)
    assert link.startswith("http://127.0.0.1:8731/#case=")
    assert set(link.partition("=")[2]) <= set("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_")
    assert rs.Job.load(unpacked(link)) == job


def test_a_link_goes_to_the_studio_s_address() -> None:
    assert studio_link(rs.Job.load({}).case, address="http://studio.example/").startswith(
        "http://studio.example/#case="
    )


def test_files_of_a_case_are_named_as_uploads(tmp_path: Path) -> None:
    mesh = tmp_path / "my <roof>.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    case = rs.Job.load({"target": {"kind": "mesh", "file": str(mesh), "unit": "m"}}).case
    tables, paths = page_case(case)
    assert tables["target"]["file"] == "upload:my _roof_.obj"
    assert paths == {"my _roof_.obj": mesh}
    assert str(tmp_path) not in json.dumps(unpacked(studio_link(case)))


def test_what_no_case_file_can_describe_has_no_link() -> None:
    target = rs.HeightField(function=lambda x, y: 1 - x * x - y * y, domain=rs.Disc(0.9))
    layout = rs.GridLayout(rods=(9, 9), spacing=(0.2, 0.2), length=2.0, edge=0.1)
    case = rs.Job(target, layout, rs.Rod(rs.Circle(0.01), rs.Material(1e9, 1e3))).case
    with pytest.raises(InputError, match="the studio cannot hold"):
        studio_link(case)


def test_a_case_that_the_studio_does_not_read_has_no_link(monkeypatch: pytest.MonkeyPatch) -> None:
    case = rs.Job.load({"drawings": {"project": 1_500_000 * "x"}}).case
    with pytest.raises(InputError, match=r"has 1\.5 MB and the studio reads 1 MB at most: .*RODSHELL_LIMITS=2"):
        studio_link(case)
    monkeypatch.setenv("RODSHELL_LIMITS", "2")
    assert studio_link(case)
