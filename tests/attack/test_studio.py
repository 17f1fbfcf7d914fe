"""A hostile client of the studio: all that it sends is answered, nothing outside its folder is read or written.

The server is whole but for the processes of its sessions, whose work is a stub: what reaches them is tested elsewhere
(tests/studio/test_files.py), and so is what their own modules do with a case.
"""

import json
import logging
import os
import random
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("httpx2")

from starlette.testclient import TestClient

from rodshell.studio import jobs, session
from rodshell.studio.process import WorkerProcess
from rodshell.studio.server import Settings, studio_app
from rodshell.studio.worker import News, Order

pytestmark = pytest.mark.attack

TRIES = 400 * int(os.environ.get("RODSHELL_ATTACK", "1"))
METHODS = ("GET", "HEAD", "POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "x")
NAMES = (
    *("..", ".", "", "\0", "../../secret.obj", "....//secret.obj", "\u65e5" * 80, "a" * 5000, "secret.obj", "-" * 24),
    *(
        "C:\\secret.obj",
        "\U0001f4a9" * 30 + ".obj",
        "\udcff",
        "~root",
        "*",
        "con.obj",
        "a\r\nb.obj",
        "key",
        "/etc/passwd",
    ),
)
PLACES = (
    *("/", "/static/{}", "/api/version", "/api/start", "/api/sessions", "/api/sessions/{}/live", "/api/jobs"),
    *("/api/jobs/{}", "/api/sessions/{}/uploads?name={}", "/api/sessions/{}/files.zip", "/api/sessions/{}/scenes/{}"),
    *("/{}", "//{}//", "/api/jobs/{}/files/{}", "/api/jobs/{}/files/../status.json", "/?token={}", "{}"),
)
DEEP = '{"a":' * 900 + "1" + "}" * 900
CASES = (
    *("", "x", "[]", "1", "null", "true", '"x"', "{}", "1e400", "[" * 200_000, DEEP, "-", "\0", '{"target": 1e400}'),
    *('{"target": {"kind": "\\ud800"}}', '{"a": ' + "9" * 5000 + "}", '{"target": {".file": "/secret.obj"}}'),
    *("[" + "1," * 700_000 + "1]", '{"drawings": {"name": "' + "x" * 999_000 + '"}}', '{"' + "k." * 9000 + '": 1}'),
)
BODIES = (
    *CASES,
    *(f'{{"kind": "case", "serial": {k}, "case": {case}}}' for k, case in enumerate(CASES)),
    *(
        f'{{"kind": "case", "serial": {serial}, "case": {{}}}}'
        for serial in ("[]", "1e400", "-1e308", '"x"', "9" * 4000)
    ),
    *(f'{{"kind": "step", "by": {by}}}' for by in ('"x"', "1e30", "-99999999999999999999", "1e400", "null", "{}")),
    *(
        f'{{"kind": "{kind}", "name": {name}}}'
        for kind in ("keep", "drop")
        for name in ("{}", '""', '"../x"', '"\\u0000"')
    ),
    *('{"kind": "case"}', '{"kind": []}', '{"serial": {"a": []}}', '{"serial": 1e400}'),
)
HEADERS = (
    *("", "host: evil.example", "host: ", "origin: null", "origin: http://testserver", "cookie: rodshell-80=x; =; ;;"),
    *(
        'cookie: ="\\',
        "authorization: Bearer",
        "authorization: Basic \xff",
        "content-length: x",
        "content-type: a;b=\xff",
    ),
    *("range: bytes=9-1,0-99999", "if-none-match: *", "transfer-encoding: chunked", "accept-encoding: " + "x" * 9000),
)


class Stub(WorkerProcess):
    """Fails each order at once, in a sentence."""

    def order(self, order: Order) -> None:
        if order.kind != "files":
            self._heard(News(order.serial, "taken"))
        self._heard(News(order.serial, "failed", {"sentence": "a stub finds nothing"}))


TOUCHED: list[str] | None = None  # paths, while an attack runs


def _hear(event: str, arguments: Any) -> None:
    if TOUCHED is not None and event in ("open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.listdir"):
        paths = arguments[: 2 if event == "os.rename" else 1]
        TOUCHED.extend(os.fspath(path) for path in paths if isinstance(path, str | os.PathLike))


sys.addaudithook(_hear)


@pytest.fixture
def attacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> Iterator[TestClient]:
    """A client of a server; afterwards nothing was touched outside its folder, nothing went wrong, and it works."""
    for module in (session, jobs):
        monkeypatch.setattr(module, "WorkerProcess", Stub)
    (tmp_path / "secret.obj").write_text("SECRET")
    (tmp_path / "kept").mkdir()
    touched = list[str]()
    with TestClient(studio_app(Settings(tmp_path / "kept", ("testserver",)))) as client:
        client.get("/static/viewer.js")  # which it reads once
        monkeypatch.setattr(sys.modules[__name__], "TOUCHED", touched)
        yield client
        monkeypatch.setattr(sys.modules[__name__], "TOUCHED", None)
        with client.websocket_connect(f"/api/sessions/{client.post('/api/sessions').json()['id']}/live") as socket:
            assert socket.receive_json()["kind"] == "session"
    ours, code = str(tmp_path / "kept"), (str(Path(session.__file__).parents[1]), sys.prefix, sys.base_prefix)
    outside = [path for path in touched if not os.path.realpath(path).startswith((ours, *code))]
    assert outside == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["kept", "secret.obj"]
    assert [record for record in caplog.records if record.levelno >= logging.ERROR or record.exc_info] == []


async def asked(app: Any, method: str, place: str, header: str, body: bytes, cut: bool) -> tuple[int, str]:
    """Status and text of an answer to a request that need not be one that a client can write; it may be cut off."""
    path, _, query = place.partition("?")
    name, _, value = header.partition(": ")
    headers = [(b"host", b"testserver")] * (name != "host") + [(name.encode(), value.encode("latin-1"))] * bool(name)
    scope = {
        "type": "http",
        "method": method,
        "path": path,
        "raw_path": path.encode("utf-8", "replace"),
        "headers": headers,
    }
    scope |= {"query_string": query.encode("utf-8", "replace"), "server": ("testserver", 80), "client": ("there", 1)}
    scope |= {"http_version": "1.1", "scheme": "http", "root_path": "", "headers": headers}
    parts = [body[:100_000], body[100_000:]]
    answers = list[dict[str, Any]]()

    async def receive() -> dict[str, Any]:
        if (cut and len(parts) < 2) or not parts:
            return {"type": "http.disconnect"}
        return {"type": "http.request", "body": parts.pop(0), "more_body": bool(parts)}

    async def send(message: dict[str, Any]) -> None:
        answers.append(message)

    await app(scope, receive, send)
    assert not any({10, 13, 0} & set(key + value) for key, value in answers[0]["headers"]), (place, answers[0])
    content = b"".join(answer.get("body", b"") for answer in answers[1:])
    return answers[0]["status"], content.decode("utf-8", "replace")


def test_every_request_is_answered(attacked: TestClient) -> None:
    chance = random.Random(39)
    known = [attacked.post("/api/sessions").json()["id"], attacked.post("/api/jobs", json={}).json()["id"]]
    assert attacked.portal is not None
    seen = set[int]()
    for _ in range(5 * TRIES):
        place, method, header, body = (chance.choice(choices) for choices in (PLACES, METHODS, HEADERS, BODIES))
        place = place.format(*(chance.choice(known if chance.random() < 0.5 else NAMES) for _ in range(3)))
        cut = chance.random() < 0.1
        status, text = attacked.portal.call(asked, attacked.app, method, place, header, body.encode(), cut)
        said = f"{method} {place!r} {header!r} {body[:60]!r} {cut} -> {status} {text[:200]}"
        seen.add(status)
        assert status < 500, said
        assert "SECRET" not in text, said
        assert "Traceback" not in text, said
        if status == 400 and not cut:
            sentence = json.loads(text)["sentence"]
            assert 5 < len(sentence) < 400, said
            assert "\n" not in sentence, said
    assert seen >= {200, 201, 202, 400, 403, 404, 405}


def test_every_message_is_answered_and_the_session_goes_on(attacked: TestClient) -> None:
    chance = random.Random(40)
    name = attacked.post("/api/sessions").json()["id"]
    with attacked.websocket_connect(f"/api/sessions/{name}/live") as socket:
        assert socket.receive_json()["kind"] == "session"
        for message in (*(mutated(chance, BODIES) for _ in range(TRIES)), *BODIES):
            as_bytes = chance.random() < 0.1
            (socket.send_bytes if as_bytes else socket.send_text)(message.encode() if as_bytes else message)  # type: ignore[operator]
            kind = "" if as_bytes else kind_of(message)
            socket.send_json({"kind": "step", "by": 0})  # answered at once, after all that is answered at once
            socket.send_json({"kind": "drop", "name": "nothing"})  # and this after all other news
            found = heard(socket, "session", 1 + (kind == "step"))
            refused = any(answer["kind"] == "failed" and "stub" not in answer["sentence"] for answer in found)
            dropped = kind == "drop" and not refused
            found += heard(socket, "variants", 1 + dropped - sum(answer["kind"] == "variants" for answer in found))
            failed = [answer["sentence"] for answer in found if answer["kind"] == "failed"]
            assert all(5 < len(sentence) < 400 and "\n" not in sentence for sentence in failed), message[:80]
            assert len(failed) == (kind not in ("step", "drop") or refused), (message[:80], found)


def heard(socket: Any, kind: str, count: int) -> list[dict[str, Any]]:
    """The next messages, up to so many of a kind."""
    found = list[dict[str, Any]]()
    while sum(message["kind"] == kind for message in found) < count:
        found.append(socket.receive_json())
    return found


def kind_of(message: str) -> str:
    """The kind of a message that is read at all."""
    try:
        return str(json.loads(message)["kind"]) if len(message) <= 1_000_000 else ""
    except (ValueError, TypeError, KeyError, RecursionError):
        return ""


def mutated(chance: random.Random, texts: tuple[str, ...]) -> str:
    """A text with some characters changed, left out or doubled."""
    text = list(chance.choice([text for text in texts if len(text) < 5000]) or "{}")
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(text)) if text else 0
        text[at : at + 1] = chance.choice(
            (["\x00"], [], ['"'], ["{"], ["9", "e", "9", "9", "9"], text[at:], ["\ufffd"])
        )
    return "".join(text)


@pytest.mark.parametrize("kind", ["sessions", "jobs"])
def test_records_of_any_bytes_stop_no_server(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (session, jobs):
        monkeypatch.setattr(module, "WorkerProcess", Stub)
    chance = random.Random(41)
    good = {
        "sessions": {"cases": [{"target": {"kind": "cap"}}, {}], "at": 1, "variants": [
            {"name": "a", "case": {}, "scene": "0" * 16, "figures": [["a", "b"]], "verdict": {"headline": "x"}}]},
        "jobs": {"status": "queued", "case": {"target": {"kind": "cap"}}, "sentence": "x"},
    }[kind]  # fmt: skip
    names = [f"{k:024}" for k in range(TRIES // 4)]
    for name in names:
        (tmp_path / kind / name).mkdir(parents=True)
        text = mutated(chance, (json.dumps(good),)).encode() + chance.randbytes(chance.choice((0, 0, 3)))
        (tmp_path / kind / name / ("session.json" if kind == "sessions" else "status.json")).write_bytes(text)
    with TestClient(studio_app(Settings(tmp_path, ("testserver",)))) as client:
        for name in names:
            if kind == "jobs":
                assert client.get(f"/api/jobs/{name}").json()["status"] == "failed"
                continue
            assert client.get(f"/api/sessions/{name}/scenes/{'0' * 16}").status_code == 404
            with client.websocket_connect(f"/api/sessions/{name}/live") as socket:
                said = socket.receive()
                assert said.get("code") == 4404 or json.loads(said["text"])["kind"] == "session"
