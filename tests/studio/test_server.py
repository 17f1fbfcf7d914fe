"""The studio: who is let in, what it reads and keeps, and that what it finds is what the command line finds."""

import errno
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodshell as rs
from rodshell.case.link import upload_name
from rodshell.cli import main
from rodshell.errors import InputError

pytest.importorskip("starlette")
pytest.importorskip("httpx2")

from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from rodshell.studio.server import Settings, studio_app
from rodshell.studio.start import own_folder

DOME: dict[str, Any] = {
    "target": {"kind": "hemisphere"},
    "layout": {"spacing": "50 mm", "edge": "25 mm"},
    "rod": {"section": {"radius": "1 mm"}, "material": {"youngs_modulus": "1 MPa"}},
    "checks": {"stages": 0},
}


def settings(folder: Path, **more: Any) -> Settings:
    return Settings(folder, **{"hosts": ("testserver",), "first": DOME, **more})


@pytest.fixture
def client(tmp_path: Path) -> Iterator[TestClient]:
    with TestClient(studio_app(settings(tmp_path))) as made:
        yield made


def new_session(client: TestClient) -> str:
    return str(client.post("/api/sessions").json()["id"])


def test_the_page_may_load_nothing_from_elsewhere(client: TestClient) -> None:
    page = client.get("/")
    assert page.status_code == 200
    assert "default-src 'none'" in page.headers["content-security-policy"]
    assert "unsafe" not in page.headers["content-security-policy"]
    for name in ("studio.js", "studio.css", "viewer.js", "viewer.css", "lil-gui.js", "lil-gui.css"):
        assert f"/static/{name}" in page.text or name in client.get("/static/studio.js").text
        assert client.get(f"/static/{name}").status_code == 200
    assert client.get("/static/server.py").status_code == 404
    assert client.get("/static/..%2fserver.py").status_code == 404


def test_another_site_s_page_is_refused(client: TestClient) -> None:
    assert client.post("/api/jobs", json=DOME, headers={"origin": "https://evil.example"}).status_code == 403
    assert client.get("/api/version", headers={"host": "evil.example"}).status_code == 403
    session = new_session(client)
    with (
        pytest.raises(WebSocketDisconnect),
        client.websocket_connect(f"/api/sessions/{session}/live", headers={"origin": "https://evil.example"}),
    ):
        pass
    assert client.post("/api/sessions", headers={"origin": "http://testserver"}).status_code == 201


def test_a_page_keeps_a_cookie_which_holds_when_the_server_is_started_again(tmp_path: Path) -> None:
    key = own_folder(tmp_path)
    assert own_folder(tmp_path) == key
    assert all((tmp_path / name).stat().st_mode & 0o077 == 0 for name in ("key", "sessions", "jobs"))
    (tmp_path / "key").chmod(0o644)  # somebody may have read it
    assert own_folder(tmp_path) != key
    key = own_folder(tmp_path)
    with TestClient(studio_app(settings(tmp_path, token="one", once="used", key=key))) as client:
        assert (refused := client.get("/")).status_code == 403
        assert (
            "studio.js" in refused.text
        )  # which says what is missing, or has a cookie that links from elsewhere have not
        assert client.get("/api/start").json()["sentence"].startswith("this server needs its token")
        page = client.get("/?token=used")
        assert page.status_code == 200
        assert page.headers["set-cookie"] == f"rodshell-80={key}; HttpOnly; SameSite=Strict; Path=/"
        session = new_session(client)
    with TestClient(
        studio_app(settings(tmp_path, token="two", once="again", key=key)), cookies=client.cookies
    ) as client:
        with client.websocket_connect(f"/api/sessions/{session}/live") as socket:
            assert socket.receive_json()["kind"] == "session"
        client.cookies.clear()
        for wrong in ("one", "used", key, "", "tw\u00f6", "two%0d%0aX:%20y", "%ff"):
            assert client.get(f"/api/version?token={wrong}").status_code == 403
            with (
                pytest.raises(WebSocketDisconnect),
                client.websocket_connect(f"/api/sessions/{session}/live?token={wrong}"),
            ):
                pass
        assert client.get("/api/version?token=again").status_code == 200
        client.cookies.clear()
        assert client.get("/api/version?token=again").status_code == 403  # it was used


def test_a_token_that_was_not_asked_for_is_not_answered_with_a_cookie(client: TestClient) -> None:
    assert "set-cookie" not in client.get("/?token=x%0d%0aX:%20y").headers


@pytest.mark.parametrize(("options", "tokens"), [((), 2), (("--no-token",), 0)])
def test_the_printed_address_and_the_opened_one_have_tokens(
    options: tuple[str, ...], tokens: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    opened = list[str]()

    class Now:
        def __init__(self, _: float, call: Any, arguments: list[str]) -> None:
            self.start = lambda: call(*arguments)

    monkeypatch.setattr("threading.Timer", Now)
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr("uvicorn.Server.run", lambda *_, **__: None)
    assert main(["studio", "--port", "0", "--folder", str(tmp_path / "kept"), *options]) == 0
    addresses = [*opened, capsys.readouterr().err.split()[2]]
    assert len({address.partition("?")[0] for address in addresses}) == 1
    found = {address.partition("?token=")[2] for address in addresses} - {""}
    assert len(found) == tokens
    assert all(len(token) == 24 for token in found)


def test_other_machines_are_not_let_in_without_a_token(capsys: Any) -> None:
    assert main(["studio", "--no-browser", "--host", "0.0.0.0", "--no-token"]) == 2
    assert "--no-token: other machines reach --host 0.0.0.0" in capsys.readouterr().err


def test_from_another_machine_a_token_is_needed(tmp_path: Path) -> None:
    app = studio_app(settings(tmp_path, hosts=(), token="right"))
    with TestClient(app) as client:
        assert client.get("/api/version").status_code == 403
        assert client.get("/api/version?token=wrong").status_code == 403
        assert client.post("/api/jobs", json=DOME, headers={"authorization": "Bearer wrong"}).status_code == 403
        assert client.get("/api/version", headers={"authorization": "Bearer right"}).status_code == 200
        client.cookies.clear()
        assert client.get("/?token=right").status_code == 200
        assert client.get("/api/version").status_code == 200  # by the cookie


@pytest.mark.parametrize("path", ["/static/studio.js", "/static/none", "/api/version", "/"])
def test_only_an_address_with_the_right_token_is_answered_with_the_cookie(path: str, tmp_path: Path) -> None:
    """Scripts are sent to everybody; the key once went with them, whatever token was asked for."""
    with TestClient(studio_app(settings(tmp_path, hosts=(), token="right", key="kept"))) as client:
        for query in ("", "?token=", "?token=wrong", "?token=kept"):
            assert "set-cookie" not in client.get(f"{path}{query}").headers
        assert client.get("/api/version").status_code == 403


def test_a_link_in_a_job_s_folder_is_not_among_its_files(client: TestClient, tmp_path: Path) -> None:
    name = "a" * 24
    result = tmp_path / "jobs" / name / "result"
    result.mkdir(parents=True)
    (result.parent / "status.json").write_text('{"status": "done", "case": {}}')
    (tmp_path / "secret").write_text("mine")
    (result / "result.json").write_text("{}")
    (result / "link").symlink_to(tmp_path / "secret")
    assert client.get(f"/api/jobs/{name}").json()["files"] == ["result.json"]
    assert client.get(f"/api/jobs/{name}/files/link").status_code == 404


def test_no_climbing_name_is_answered(client: TestClient, tmp_path: Path) -> None:
    (tmp_path / "secret.obj").write_text("v 0 0 0\n")
    assert client.get("/api/jobs/..%2f..%2fsecret.obj").status_code == 404
    assert client.get(f"/api/sessions/{new_session(client)}/scenes/..%2fsession.json").status_code == 404


def test_a_page_without_its_session_gets_another(client: TestClient) -> None:
    with client.websocket_connect("/api/sessions/nothing/live") as socket:  # accepted: else the page hears no code
        assert socket.receive() == {"type": "websocket.close", "code": 4404, "reason": "there is no such session"}


def test_uploads_are_few_kinds_and_not_too_large(tmp_path: Path) -> None:
    with TestClient(studio_app(settings(tmp_path, largest_upload=1000))) as client:
        place = f"/api/sessions/{new_session(client)}/uploads"
        large = client.post(f"{place}?name=a.obj", content=b"v" * 2000)
        assert large.status_code == 400
        assert "larger than 0.001 MB" in large.json()["sentence"]
        assert client.post(f"{place}?name=a.exe", content=b"v").status_code == 400
        assert client.post(f"{place}?name=..%2F..%2Fa.obj", content=b"v").json() == {"file": "upload:a.obj"}
        assert [path.name for path in tmp_path.rglob("a.obj")] == ["a.obj"]
        assert not list(tmp_path.rglob("uploads/.*"))


def test_a_full_disk_is_answered_in_a_sentence(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    session = new_session(client)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    for answer in (
        client.post(f"/api/sessions/{session}/uploads?name=a.obj", content=b"v"),
        client.post("/api/jobs", json=DOME),
    ):
        assert answer.status_code == 507
        assert answer.json()["sentence"] == "the server cannot keep or read this (No space left on device)"
    with client.websocket_connect(f"/api/sessions/{session}/live") as socket:
        socket.receive_json()
        socket.send_json({"kind": "case", "serial": 1, "case": DOME})
        assert "No space left" in socket.receive_json()["sentence"]
        socket.send_json({"kind": "step", "by": 0})
        assert [socket.receive_json()["kind"] for _ in range(2)] == ["history", "failed"]


def test_names_of_uploads_are_plain() -> None:
    assert upload_name("C:\\roofs\\<b>roof</b>.OBJ") == "b_.OBJ"
    assert upload_name("../../roof 2.obj") == "roof 2.obj"
    for name in ("", ".obj", "a.py", "..", "a.obj/", "case.toml"):
        with pytest.raises(InputError, match="the studio reads"):
            upload_name(name)
    with pytest.raises(InputError, match=r"save it as \.glb"):
        upload_name("roof.gltf")
    assert upload_name(90 * "\u65e5" + ".obj") == 32 * "\u65e5" + ".obj"  # 100 bytes, not 100 characters


def test_every_file_that_the_page_offers_can_be_uploaded(client: TestClient) -> None:
    start, session = client.get("/api/start").json(), new_session(client)
    units = {key["path"]: key["unit"] for key in start["keys"]}
    assert [units[path] for path in ("layout.spacing", "layout.rotate", "rod.material.density")] == [
        "m",
        "rad",
        "kg/m3",
    ]
    assert "lath 12 x 30 mm" in start["sold"]["larch"]
    for suffix in (*start["surfaces"], *start["outlines"]):
        answer = client.post(f"/api/sessions/{session}/uploads?name=roof{suffix}", content=b"v")
        assert answer.json() == {"file": f"upload:roof{suffix}"}


def until_done(socket: Any, serial: int) -> list[dict[str, Any]]:
    """All messages up to the end of an order; a scene is put with its stage."""
    messages: list[dict[str, Any]] = []
    while True:
        message = socket.receive()
        if "bytes" in message and message["bytes"] is not None:
            messages[-1]["content"] = message["bytes"]
            continue
        messages.append(json.loads(message["text"]))
        if messages[-1]["kind"] in ("done", "failed") and messages[-1]["serial"] == serial:
            return messages


@pytest.mark.slow
def test_a_session_shows_each_stage_and_ends_with_the_command_line_s_form(tmp_path: Path) -> None:
    expected = rs.Job.load(DOME).run()
    with TestClient(studio_app(settings(tmp_path))) as client:
        session = new_session(client)
        with client.websocket_connect(f"/api/sessions/{session}/live") as socket:
            assert socket.receive_json()["cases"] == []
            turned = {**DOME, "layout": {**DOME["layout"], "rotate": 0.1}}
            for serial, (case, live) in enumerate([(turned, True), (DOME, False)], start=1):
                socket.send_json({"kind": "case", "serial": serial, "case": case, "live": live})
                stages = [message for message in until_done(socket, serial) if message["kind"] == "stage"]
                assert [stage["stage"] for stage in stages] == ["drape", "pop-up"] + ["checks"] * (not live)
                assert all(stage["content"] for stage in stages)
            assert stages[-1]["verdict"]["headline"] == expected.verdict.headline
            socket.send_json({"kind": "keep", "name": "first"})
            said = socket.receive_json()
            assert (said["kind"], [variant["name"] for variant in said["variants"]]) == ("variants", ["first"])
            with client.websocket_connect(f"/api/sessions/{session}/live") as other:
                assert [variant["name"] for variant in other.receive_json()["variants"]] == ["first"]
                for number, name in enumerate(("second", "third"), start=2):  # each page shows what another one keeps
                    other.send_json({"kind": "keep", "name": name})
                    assert len(socket.receive_json()["variants"]) == len(other.receive_json()["variants"]) == number
                for name in ("second", "third"):
                    socket.send_json({"kind": "drop", "name": name})
                    assert socket.receive_json()["variants"] == other.receive_json()["variants"]
            kept = json.loads((tmp_path / "sessions" / session / "session.json").read_text())
            assert [variant["name"] for variant in kept["variants"]] == ["first"]
            socket.send_json({"kind": "case", "serial": 3, "case": {"target": {"radius": "no"}}})
            assert "target.radius" in until_done(socket, 3)[-1]["sentence"]
        packed = client.get(f"/api/sessions/{session}/files.zip")
        assert packed.content[:2] == b"PK"
        scene = client.get(f"/api/sessions/{session}/scenes/{last_state(tmp_path)['variants'][0]['scene']}")
        assert scene.content == stages[-1]["content"]
    # another server on the same folder goes on where this one was
    with (
        TestClient(studio_app(settings(tmp_path))) as client,
        client.websocket_connect(f"/api/sessions/{session}/live") as socket,
    ):
        state = socket.receive_json()
        assert state["cases"][0] == DOME
        assert [variant["name"] for variant in state["variants"]] == ["first"]
        socket.send_json({"kind": "step", "by": -1})
        assert socket.receive_json()["at"] == state["at"] - 1


@pytest.mark.slow
def test_no_path_of_the_server_is_told(tmp_path: Path) -> None:
    roof = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 2 2 1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n"
    with TestClient(studio_app(settings(tmp_path))) as client:
        session = new_session(client)
        file = client.post(f"/api/sessions/{session}/uploads?name=roof.obj", content=roof.encode()).json()["file"]
        with client.websocket_connect(f"/api/sessions/{session}/live") as socket:
            socket.receive_json()
            for serial, more in enumerate(({}, {"unit": "m", "base": "9 m"}), start=1):
                case = {"target": {"kind": "mesh", "file": file, **more}}
                socket.send_json({"kind": "case", "serial": serial, "case": case})
                said = until_done(socket, serial)[-1]["sentence"]
                assert "roof.obj" in said
                assert str(tmp_path) not in said
            smooth = {"target": {"kind": "mesh", "file": file, "unit": "m"}, **{k: DOME[k] for k in ("rod", "checks")}}
            socket.send_json({"kind": "case", "serial": 9, "case": smooth})
            assert str(tmp_path) not in json.dumps([{**m, "content": ""} for m in until_done(socket, 9)])


def last_state(folder: Path) -> dict[str, Any]:
    (path,) = folder.glob("sessions/*/session.json")
    state: dict[str, Any] = json.loads(path.read_text())
    return state


@pytest.mark.slow
def test_a_job_of_a_program_gives_its_result_and_files(client: TestClient) -> None:
    expected = rs.Job.load(DOME).run(until="pop-up")
    answer = client.post("/api/jobs", json=DOME)
    assert answer.status_code == 202
    bad = client.post("/api/jobs", json={"target": {"kind": "cube"}}).json()["id"]
    done = wait(client, answer.json()["id"])
    assert done["status"] == "done"
    assert done["result"]["status"] == "converged"
    assert {"result.json", "states.npz", "report.html"} <= set(done["files"])
    content = client.get(f"/api/jobs/{answer.json()['id']}/files/states.npz").content
    from io import BytesIO

    np.testing.assert_array_equal(np.load(BytesIO(content))["popped_pinned"], expected.popped["pinned"].positions)
    assert client.get(f"/api/jobs/{answer.json()['id']}/files/../status.json").status_code == 404
    failed = wait(client, bad)
    assert failed["status"] == "failed"
    assert "target.kind" in failed["sentence"]
    assert client.get("/api/jobs/nothing").status_code == 404


@pytest.mark.parametrize(
    "body",
    [
        '{"layout": {"spacing": NaN}}',
        '{"layout": {"spacing": 1e999}}',
        '{"target": {"kind": "\\ud800"}}',
        "[" * 100_000,
        '{"seams": {"lines": ' + "[" * 500 + "]" * 500 + "}}",
    ],
    ids=["nan", "infinite", "half of a character", "without an end", "deep"],
)
def test_a_case_that_is_no_plain_json_is_refused_in_a_sentence(client: TestClient, tmp_path: Path, body: str) -> None:
    answer = client.post("/api/jobs", content=body)
    assert answer.status_code == 400
    assert "case" in answer.json()["sentence"]
    assert not list(tmp_path.glob("jobs/*"))


def test_a_session_keeps_no_case_that_cannot_be_sent_back(client: TestClient) -> None:
    session = new_session(client)
    with client.websocket_connect(f"/api/sessions/{session}/live") as socket:
        socket.receive_json()
        socket.send_text('{"kind": "case", "serial": 1, "case": {"layout": {"spacing": NaN}}}')
        assert "finite numbers" in socket.receive_json()["sentence"]
        assert socket.receive_json()["count"] == 0


@pytest.mark.parametrize("number", ["NaN", "-Infinity", "1e999"])
def test_what_an_earlier_server_stored_with_numbers_that_are_no_json_is_served(tmp_path: Path, number: str) -> None:
    name, case = "a" * 24, f'{{"layout": {{"spacing": {number}}}, "target": {{"kind": "\\ud800"}}}}'
    for folder, file, text in (
        ("jobs", "status.json", f'{{"status": "failed", "case": {case}, "sentence": "not a finite number"}}'),
        ("sessions", "session.json", f'{{"cases": [{case}], "at": 0, "variants": []}}'),
    ):
        (tmp_path / folder / name).mkdir(parents=True)
        (tmp_path / folder / name / file).write_text(text)
    expected = {"layout": {"spacing": None}, "target": {"kind": "\ud800"}}
    with TestClient(studio_app(settings(tmp_path))) as client:
        job = client.get(f"/api/jobs/{name}")
        assert job.status_code == 200
        assert job.json() == {"id": name, "status": "failed", "case": expected, "sentence": "not a finite number"}
        with client.websocket_connect(f"/api/sessions/{name}/live") as socket:
            said = socket.receive_text()
            said.encode()  # as a server does that is not a test's
            assert json.loads(said)["cases"] == [expected]


def test_a_job_with_numbers_that_are_no_json_and_still_waits_fails_in_a_sentence(tmp_path: Path) -> None:
    name = "a" * 24
    (tmp_path / "jobs" / name).mkdir(parents=True)
    (tmp_path / "jobs" / name / "status.json").write_text('{"status": "queued", "case": {"layout": {"spacing": NaN}}}')
    with TestClient(studio_app(settings(tmp_path))) as client:
        status = wait(client, name)
    assert status["status"] == "failed"
    assert status["sentence"].startswith("layout.spacing = ")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--folder", "plain"), "cannot keep sessions in plain (Not a directory)"),
        (("--port", "99999"), "'--port': 99999"),
    ],
)
def test_a_folder_or_port_that_cannot_be_used_is_refused_at_the_start(
    options: tuple[str, str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("uvicorn.Server.run", lambda *_, **__: pytest.fail("it was served"))
    Path("plain").write_text("")
    assert main(["studio", "--no-browser", "--port", "0", *options]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1


def wait(client: TestClient, job: str) -> dict[str, Any]:
    for _ in range(1200):
        status: dict[str, Any] = client.get(f"/api/jobs/{job}").json()
        if status["status"] in ("done", "failed"):
            return status
        time.sleep(0.1)
    raise AssertionError("the job does not end")
