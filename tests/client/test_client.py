"""The client on Python 3.9 against the studio's server: results equal to the server's; one sentence for each failure.

RODSHELL_PYTHON39 names a Python 3.9; otherwise uv finds one. The client runs there, with nothing installed.
"""

import http.server
import json
import os
import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodshell as rs
from tests.targets.meshes import sheet

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")

CLIENT = Path(__file__).parents[2] / "client"
ROD = {"section": {"radius": "1 mm"}, "material": {"youngs_modulus": "1 MPa"}}
DOME = {"target": {"kind": "hemisphere"}, "layout": {"spacing": "50 mm", "edge": "25 mm"}, "rod": ROD,
        "checks": {"stages": 0}, "pop_up": {"ends": "pinned"}}  # fmt: skip
ROOF: dict[str, Any] = {"target": {"kind": "mesh", "file": "upload:roof.obj", "unit": "m", "base": 0}, "rod": ROD,
        "layout": {"rods": [5, 5], "spacing": "0.15 m"}, "checks": {"stages": 0},
        "pop_up": {"ends": "pinned"}}  # fmt: skip
FIND = """
import json, sys
from rodshell_client import Client, ServerError, obj_text
given = json.load(sys.stdin)
try:
    client = Client(given["address"])
    files = {name: obj_text(*mesh) for name, mesh in given["meshes"].items()}
    form = client.find(given["case"], files, **given.get("more", {}))
    found = {name: getattr(form, name) for name in ("lines", "flat", "joints", "verdict", "findings")}
    print(json.dumps(dict(found, python=sys.version_info[:2], tree=form.tree())))
except ServerError as error:
    print(json.dumps({"sentence": str(error)}))
"""


@cache
def python39() -> str:
    """A Python 3.9."""
    if (named := os.environ.get("RODSHELL_PYTHON39")) is not None:
        return named
    uv = shutil.which("uv")
    found = uv and subprocess.run([uv, "python", "find", "3.9"], capture_output=True, text=True).stdout.strip()
    if not found:
        pytest.skip("no Python 3.9: pip install uv; uv python install 3.9")
    return found


def asked(address: str, case: dict[str, Any], python: str | None = None, **given: Any) -> dict[str, Any]:
    """What the client finds there."""
    environment = {"PYTHONPATH": str(CLIENT / "src"), "PATH": os.environ["PATH"]}
    text = json.dumps({"address": address, "case": case, "meshes": {}, **given})
    command = [python or sys.executable, "-c", FIND]
    done = subprocess.run(command, input=text, capture_output=True, text=True, env=environment, timeout=300)
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Of a real server."""
    folder = str(tmp_path_factory.mktemp("studio"))
    command = [sys.executable, "-m", "rodshell", "studio", "--no-browser", "--port", "0", "--folder", folder]
    server = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    assert server.stderr
    found = re.search(r"http://\S+", server.stderr.readline())
    assert found
    yield found[0]
    server.terminate()
    server.wait()


@contextmanager
def pretender(answer: bytes, seconds: float = 0.0) -> Iterator[str]:
    """A server that answers every request in one way, after some time."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            late.wait(seconds)
            self.send_response(200)
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *_: object) -> None:
            pass

    late, server = threading.Event(), http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    late.set()
    server.shutdown()
    server.server_close()


@pytest.mark.slow
def test_on_python_39_a_dome_and_a_mesh_roof_are_the_server_s(address: str, tmp_path: Path) -> None:
    vertices, faces = sheet(lambda x, y: np.asarray(0.3 - 0.5 * x**2 - 0.5 * y**2), 0.8, 24)
    mesh = vertices.tolist(), faces.tolist()
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh[0]] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh[1]]
    (tmp_path / "roof.obj").write_text("\n".join(lines) + "\n")
    roof = ROOF | {"target": {**ROOF["target"], "file": str(tmp_path / "roof.obj")}}
    for case, same, meshes in ((DOME, DOME, {}), (ROOF, roof, {"roof.obj": mesh})):
        found = asked(address, case, python39(), meshes=meshes)
        assert "sentence" not in found, found
        assert found["python"] == [3, 9]
        ours = rs.Job.load(same).run().archive()
        nodes = ours.states["rod_nodes"]
        np.testing.assert_array_equal(np.vstack([*found["lines"].values()]), ours.states["popped_pinned"][nodes])
        assert [*found["lines"]] == [rod.id for rod in ours.results.rods] == [*found["flat"]]
        assert [line for family in found["tree"] for line in family] == [*found["lines"].values()]
        assert len(found["tree"]) == 2
        assert (found["verdict"], len(found["findings"])) == (ours.verdict.level, len(ours.verdict.findings))
        lengths = [np.linalg.norm(np.subtract(*ends)) for ends in found["flat"].values()]
        np.testing.assert_allclose(lengths, [rod.end - rod.start for rod in ours.results.rods], rtol=1e-9)
        assert len(found["joints"]) == sum(len(rod.joints) for rod in ours.results.rods) / 2


def test_a_case_that_is_refused_gives_the_server_s_sentence(address: str) -> None:
    assert "hemispher" in asked(address, DOME | {"target": {"kind": "hemispher"}})["sentence"]
    assert "upload it first" in asked(address, ROOF)["sentence"]


def test_a_wrong_token_is_told_where_the_right_one_is(address: str) -> None:
    sentence = asked(address.partition("?")[0] + "?token=wrong", DOME)["sentence"]
    assert sentence == "this server needs its token: open the address that it printed when it was started"


def test_a_server_that_waits_is_busy(address: str) -> None:
    sentence = asked(address, DOME, more={"wait": 0.0})["sentence"]
    assert re.fullmatch(
        r"the studio at \S+ is busy: after 0 s this form is .*; wait longer, or end other jobs", sentence
    )


def test_a_server_that_is_gone_or_another_is_one_sentence() -> None:
    with pretender(b'{"rodshell": "7.5.1"}') as address:
        sentence = asked(address, DOME)["sentence"]
        words = (
            r"the studio at \S+ is rodshell 7\.5\.1, and this client is for 0\.\d\.\d: install rodshell-client 7\.5\.1"
        )
        assert re.fullmatch(words, sentence)
    sentence = asked(address, DOME)["sentence"]  # it has gone
    assert re.fullmatch(
        r"no studio answers at \S+: start `rodshell studio` and give the address that it prints", sentence
    )
    with pretender(b"<html>") as address:
        assert "is no rodshell studio" in asked(address, DOME)["sentence"]
    assert "must be one such as http://127.0.0.1:8731/?token=TOKEN" in asked("127.0.0.1:8731", DOME)["sentence"]


def test_a_server_that_says_nothing_is_busy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(CLIENT / "src")
    import rodshell_client

    monkeypatch.setattr(rodshell_client, "ANSWER", 0.2)
    with (
        pretender(b"{}", seconds=5.0) as address,
        pytest.raises(rodshell_client.ServerError, match=r"is busy: .* 0\.2 s"),
    ):
        rodshell_client.Client(address)


GRASSHOPPER = """
import json, sys, types
class Tree(list):
    def __class_getitem__(cls, _): return cls
    def Add(self, item, path): self.append((item, path))
rg = types.ModuleType("Rhino.Geometry")
rg.Point3d, rg.PolylineCurve = (lambda *at: at), list
rhino, gh = types.ModuleType("Rhino"), types.ModuleType("Grasshopper")
rhino.Geometry, gh.DataTree = rg, Tree
gh.Kernel = types.SimpleNamespace(Data=types.SimpleNamespace(GH_Path=int))
sys.modules.update({"Rhino": rhino, "Rhino.Geometry": rg, "Grasshopper": gh})
given = json.load(sys.stdin)
points, faces = given.pop("mesh")
vertices = [types.SimpleNamespace(X=x, Y=y, Z=z) for x, y, z in points]
faces = [types.SimpleNamespace(A=a, B=b, C=c, IsQuad=False) for a, b, c in faces]
names = dict(given, mesh=types.SimpleNamespace(Vertices=vertices, Faces=faces))
exec(open(sys.argv[1]).read(), names)
print(json.dumps({name: names[name] for name in ("rods", "flat", "joints", "verdict", "findings")}))
"""


@pytest.mark.slow
def test_the_grasshopper_component_runs_with_rhino_s_classes_in_name(address: str) -> None:
    """On Python 3.9; of Rhino only what the text uses is there, in name."""
    vertices, faces = sheet(lambda x, y: np.asarray(0.3 - 0.5 * x**2 - 0.5 * y**2), 0.8, 24)
    given = {"address": address, "mesh": (vertices.tolist(), faces.tolist()), "spacing": 0.15, "rods": 5,
             "radius": 0.001, "base": 0.0}  # fmt: skip
    command = [python39(), "-c", GRASSHOPPER, str(CLIENT / "grasshopper" / "find.py")]
    environment = {"PYTHONPATH": str(CLIENT / "src"), "PATH": os.environ["PATH"]}
    done = subprocess.run(
        command, input=json.dumps(given), capture_output=True, text=True, env=environment, timeout=300
    )
    found = json.loads(done.stdout)
    assert found["verdict"] in ("good", "check", "unbuildable"), found
    assert [path for _, path in found["rods"]] == [0] * 5 + [1] * 5 == [path for _, path in found["flat"]]
    assert len(found["joints"]) == 25
    assert found["findings"]
