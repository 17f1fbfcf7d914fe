"""result.json: every key is typed, files of earlier versions open, and a corrupt file is one sentence."""

import json
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

import rodshell as rs
from rodshell.cli import main
from rodshell.errors import OutputError
from rodshell.figures.records import Record
from rodshell.output.files import save
from rodshell.results import Archive, Results, read
from rodshell.results.results import VERSION, json_schema
from tests.output.forms import formed, wished
from tests.output.sample_archive import sample_archive, table_archive, with_deployment

ARCHIVES = {
    "wished": wished,
    "sewn": lambda: formed("sewn"),
    "roof": lambda: formed("roof"),
    "sample": sample_archive,
    "table": table_archive,
}


@pytest.fixture(params=ARCHIVES)
def made(request: pytest.FixtureRequest) -> Archive:
    return ARCHIVES[request.param]()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result with states, without other files."""
    return save(with_deployment(sample_archive()), tmp_path_factory.mktemp("results") / "dome", [])


def records(record: Record) -> list[Record]:
    """The record and all that it holds."""
    found, parts = [record], [getattr(record, name) for name in type(record).model_fields]
    while parts:
        part = parts.pop()
        if isinstance(part, Record):
            found += records(part)
        elif isinstance(part, dict | tuple):
            parts += part.values() if isinstance(part, dict) else part
    return found


@pytest.mark.slow
def test_a_file_holds_the_keys_that_were_set_and_no_others(made: Archive, tmp_path: Path) -> None:
    stored = json.loads((save(made, tmp_path / "out", []) / "result.json").read_text(encoding="utf-8"))
    assert stored == made.results.plain()
    assert Results.of(stored) == made.results
    assert Results.of(stored).plain() == stored


def test_every_key_of_a_computed_result_is_a_field(made: Archive) -> None:
    """Only tables of the case have keys that are no fields: their parameters, which the case file knows."""
    unknown = {
        type(record).__name__: set(record.model_extra or {}) for record in records(made.results) if record.model_extra
    }
    assert set(unknown) <= {"Target", "Section", "Material", "Joint", "Layout"}


def test_every_field_says_what_it_means() -> None:
    kinds, left = set[type[BaseModel]](), [Record]
    while left:
        kinds.add(kind := left.pop())
        left += kind.__subclasses__()
    fields = [(kind, name, field) for kind in kinds for name, field in kind.model_fields.items()]
    assert len(fields) > 200
    assert [f"{kind.__name__}.{name}" for kind, name, field in fields if not field.description] == []
    assert [kind.__name__ for kind in kinds if not kind.__doc__] == []


@pytest.mark.slow
def test_results_validate_against_the_schema(made: Archive) -> None:
    validator = pytest.importorskip("jsonschema", reason="pip install jsonschema").Draft202012Validator
    validator.check_schema(json_schema())
    assert list(validator(json_schema()).iter_errors(made.results.plain())) == []
    wrong = {**made.results.plain(), "rods": [{"id": 7}]}
    assert list(validator(json_schema()).iter_errors(wrong))


def test_the_command_prints_the_schema(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "--schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert schema == json_schema()
    assert schema["$defs"]["Agreement"]["properties"]["max"]["description"] == "largest gap [m]"


def test_files_of_version_1_open_with_their_keys_renamed() -> None:
    content = sample_archive().results.plain()
    content["drape"]["own_ends"] = content["drape"].pop("net_deviation")
    patch = {"id": "A", "drape": content["drape"]}
    old = Results.of({**content, "version": 1, "patches": [patch]})
    assert old.version == VERSION
    assert old.drape is not None
    assert old.drape.net_deviation == sample_archive().results.drape.net_deviation  # type: ignore[union-attr]
    assert old.patches[0].drape == old.drape
    gridshell = {"format": "gridshell-result", "version": 1, "version_gridshell": "0.1", "rods": []}
    assert Results.of(gridshell).version_rodshell == "0.1"


@pytest.mark.parametrize(("radius", "spacing"), [("4 m", "1 m"), ("5 m", "0.9 m"), ("4.2 m", "1.3 m")])
def test_crossings_without_a_joint_are_those_of_the_lines_that_have_none(radius: str, spacing: str) -> None:
    """Two lines of a square layout cross where each lies between the ends of the other."""
    layout = {"spacing": spacing, "edge": spacing, "rotate": "20 deg"}
    case = {"target": {"kind": "cap", "radius": radius, "base": "1.5 m"}, "layout": layout, "joint": {"kind": "pin"}}
    found = rs.Job.load(case | {"checks": {"stages": 0}, "pop_up": {"ends": "pinned"}}).run().archive().results
    joints = {(rod.id, joint.other) for rod in found.rods for joint in rod.joints}
    crossings = {
        (u.id, v.id)
        for u in found.rods
        for v in found.rods
        if (u.family, v.family) == ("u", "v") and u.start < v.offset < u.end and v.start < u.offset < v.end  # type: ignore[operator]
    }
    assert found.crossings_without_joint == len(crossings - joints)
    assert len(crossings & joints) == len(joints) / 2


def test_unknown_keys_are_kept_and_null_is_not_known() -> None:
    content = table_archive().results.plain() | {"later": {"key": [1, None]}, "net": {"min_angle_deg": None}}
    content["pop_up"]["pinned"]["snow"] = 2.5
    content |= {"seams": None, "agreement": None}
    found = Results.of(content)
    assert found.net is not None
    assert found.net.min_angle_deg is None
    assert (found.seams, found.agreement) == ((), {})
    assert found.plain()["later"] == {"key": [1, None]}
    assert found.plain()["pop_up"]["pinned"]["snow"] == 2.5


def test_records_cannot_be_changed() -> None:
    results = sample_archive().results
    with pytest.raises(ValueError, match="frozen"):
        results.name = "other"
    assert results.changed(name="other").name == "other"
    assert results.name == "sample dome"


def test_an_archive_is_a_line_and_can_be_compared() -> None:
    made = sample_archive()
    assert repr(made) == "<Archive sample dome: check, 18 rods, draped, popped_pinned, popped_clamped>"
    assert made == sample_archive()
    assert made != replace(made, results=made.results.changed(name="other"))
    assert made != replace(made, states={**made.states, "draped": made.states["draped"] + 1.0})
    assert made != "sample dome"
    with pytest.raises(TypeError, match="unhashable"):
        hash(made)


def _set(*path: str | int, to: Any) -> Callable[[dict[str, Any]], None]:
    def change(content: dict[str, Any]) -> None:
        for part in path[:-1]:
            content = content[part]
        content[path[-1]] = to

    return change


def _without(*path: str | int) -> Callable[[dict[str, Any]], None]:
    def change(content: dict[str, Any]) -> None:
        for part in path[:-1]:
            content = content[part]
        del content[path[-1]]

    return change


CORRUPT = {
    "a missing key": (_without("rods", 3, "id"), "rods[3].id is missing"),
    "a missing key deep inside": (_without("rods", 2, "joints", 1, "at"), "rods[2].joints[1].at is missing"),
    "a text for a number": (_set("rods", 0, "end", to="0.3"), "rods[0].end cannot be '0.3': it must be a number"),
    "true for a number": (_set("rods", 0, "end", to=True), "rods[0].end cannot be True: it must be a number"),
    "a number for a text": (_set("name", to=5), "name cannot be 5: it must be a text"),
    "half a count": (_set("drape", "dofs", to=1.5), "drape.dofs cannot be 1.5: it must be a whole number"),
    "NaN": (_set("drape", "max_gap", to=np.nan), "drape.max_gap cannot be nan: it must be a finite number, or null"),
    "infinity": (_set("boundary", 0, 2, to=np.inf), "boundary[0][2] cannot be inf: it must be a finite number"),
    "a place in the plane": (_set("boundary", 4, to=[0.0, 1.0]), "boundary[4][2] is missing"),
    "a place in four dimensions": (_set("footprint", 0, to=[0.0, 1.0, 2.0]), "footprint[0] cannot be [0.0, 1.0, 2.0]"),
    "too few places": (_set("boundary", to=[[0.0, 0.0, 0.0]]), "boundary has 1 points for 18 rods"),
    "a rod that is not there": (_set("rods", 0, "joints", 0, "with", to="X9"), 'joints[0].with: there is no rod "X9"'),
    "two rods of one name": (_set("rods", 1, "id", to="U01"), 'rods: the id "U01" occurs twice'),
    "a list for a table": (_set("pop_up", "pinned", to=[1]), "pop_up.pinned cannot be [1]: it must be a table"),
    "no name of a support": (_set("pop_up", to={"../glued": {}}), "pop_up.../glued"),
    "a list for the shape on a support": (_set("bending", to={"glued": {"rod": []}}), "bending.glued.rod"),
    "no rods but a word": (_set("rods", to="none"), "rods cannot be 'none': it must be a list"),
    "another level": (_set("verdict", to={"level": "fine", "reasons": []}), "verdict.level cannot be 'fine'"),
    "no reason": (_set("verdict", to={"level": "good", "reasons": []}), "verdict.reasons cannot be []: it must not"),
    "a newer version": (_set("version", to=99), "has version 99"),
    "no version": (_set("version", to="1"), "has version 1"),
    "another format": (_set("format", to="meshlab"), "is not a rodshell result"),
    "too many stages": (_set("deployment", "stages", to=[{"share": 0.0}]), "history has the shape (9, "),
}


def refused(folder: Path, tmp_path: Path, name: str, content: bytes, capsys: pytest.CaptureFixture[str]) -> str:
    """The sentence with which a result is refused whose file `name` has another content: by Python and by command."""
    wrong = tmp_path / "wrong"
    wrong.mkdir()
    for file in ("result.json", "states.npz", "case.toml"):
        (wrong / file).write_bytes(content if file == name else (folder / file).read_bytes())
    with pytest.raises(OutputError) as error:
        read(wrong)
    assert main(["export", str(wrong), "--only", "csv"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == f"rodshell: error: {error.value}\n"
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize("fault", CORRUPT)
def test_a_corrupt_result_is_one_sentence_that_names_the_key(
    fault: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change, words = CORRUPT[fault]
    content = deepcopy(json.loads((folder / "result.json").read_text()))
    change(content)
    assert words in refused(folder, tmp_path, "result.json", json.dumps(content).encode(), capsys)


@pytest.mark.parametrize(
    ("text", "words"),
    [(b"", "cannot read"), (b"{", "cannot read"), (b"\xff\xfe", "is not text in UTF-8: it is damaged"),
     (b"[1, 2]", "is not a table of keys"),
     (b"null", "is not a table of keys"), (b'{"a": ' + b"[" * 100_000, "cannot read"),
     (b'{"format": "rodshell-result", "version": 2, "name": "\\ud800"}', "result.json")],
)  # fmt: skip
def test_what_is_no_json_is_one_sentence(
    text: bytes, words: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert words in refused(folder, tmp_path, "result.json", text, capsys)


STATES = {
    "a node that is not there": ("rod_nodes", lambda rows: np.append(rows[:-1], 10**6), "1000000, but there are"),
    "a node before the first": ("rod_nodes", lambda rows: np.append(rows[:-1], -1), "rod_nodes holds -1"),
    "rods that begin nowhere": ("rod_start", lambda rows: rows[::-1], "rod_start must ascend"),
    "unsigned starts that descend": ("rod_start", lambda rows: (-rows % rows.max()).astype("u8"), "must ascend"),
    "a rod too few": ("rod_start", lambda rows: rows[:-1], "rod_start has the shape (17,), not (18,)"),
    "half a node": ("rod_nodes", lambda rows: rows + 0.5, "rod_nodes must be an array of whole numbers"),
    "places that are not finite": ("draped", lambda rows: rows * np.nan, "draped holds a number that is not finite"),
    "places in the plane": ("draped", lambda rows: rows[:, :2], "draped has the shape"),
    "a gap too few": ("gap_pinned", lambda rows: rows[1:], "gap_pinned has the shape"),
    "texts": ("draped", lambda rows: rows.astype(str), "draped must be an array of numbers"),
    "one number": ("flat", lambda rows: np.array(1.0), "flat has the shape ()"),
    "a stage too few": ("history", lambda rows: rows[1:], "history has the shape"),
}


@pytest.mark.parametrize("fault", STATES)
def test_corrupt_states_are_one_sentence_that_names_the_array(
    fault: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name, change, words = STATES[fault]
    with np.load(folder / "states.npz") as stored:
        states = {key: change(stored[key]) if key == name else stored[key] for key in stored.files}
    np.savez(tmp_path / "states.npz", **states)
    assert words in refused(folder, tmp_path, "states.npz", (tmp_path / "states.npz").read_bytes(), capsys)


def test_every_kind_of_file_is_made_of_the_least_result(tmp_path: Path) -> None:
    """Rods with a line each, and nothing else that is known."""
    rods = [{"id": "U1", "family": "u", "start": 0.0, "end": 1.0}, {"id": "V1", "family": "v", "start": 0, "end": 1}]
    made = Archive(Results.of({"rods": rods}), {})
    again = read(save(made, tmp_path / "least"))
    assert again == made
    assert again.summary(verbose=True).startswith("rodshell: Not known: the computation did not converge")
    assert (tmp_path / "least/report.html").exists()
