"""The studio's server: pages, sessions over WebSockets, and jobs for programs.

It answers requests and passes messages on; all computing is done in other processes. Whoever reaches it from another
machine needs its token; whoever reaches it through another site's page is refused, by the Origin and Host headers.
"""

import asyncio
import hmac
import json
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from importlib.resources import files
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.datastructures import Headers, QueryParams
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from rodshell.case.keys import case_keys
from rodshell.case.link import OUTLINES, SURFACES, UPLOAD, upload_name
from rodshell.dataclass import dataclass
from rodshell.errors import InputError
from rodshell.output.viewer import viewer_script, viewer_style
from rodshell.studio.jobs import Jobs
from rodshell.studio.session import Session, Sessions, presets, with_uploads
from rodshell.studio.worker import News

COOKIE = "rodshell-token"
STATIC = files("rodshell.studio").joinpath("static")
TYPES = {".js": "text/javascript", ".css": "text/css"}
PAGES = ("studio.js", "studio.css", "lil-gui.js", "lil-gui.css")
LARGEST_CASE = 1_000_000  # bytes of a case as JSON
DEEPEST = 20  # tables and lists of a case within one another
NO_CASE = "the body must be a case as JSON, with the tables of a case file"
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "font-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}


@dataclass(frozen=True)
class Settings:
    """How a server runs.

    Parameters
    ----------
    folder : in which sessions and jobs are kept.
    hosts : names, with the port, by which it may be reached.
    token : that requests must bring; "": none is needed, for a server that only its own machine reaches.
    first : the case with which a session begins, and the files that it names.
    time_limit : of a job [s]; largest_upload : [bytes].
    """

    folder: Path
    hosts: tuple[str, ...]
    token: str = ""
    first: dict[str, Any] | None = None
    files: dict[str, bytes] | None = None
    time_limit: float = 120.0
    largest_upload: int = 50_000_000


def studio_app(settings: Settings) -> ASGIApp:
    """The server as an ASGI application.

    Parameters
    ----------
    settings : see there.
    """
    first = settings.first or presets()["pavilion"]
    sessions = Sessions(settings.folder / "sessions", first, settings.files or {}, settings.time_limit)
    jobs = Jobs(settings.folder / "jobs", settings.time_limit)

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        jobs.resume()
        yield
        sessions.end()
        jobs.end()

    app = Starlette(
        routes=[
            Route("/", _page),
            Route("/static/{name}", _static),
            Route("/api/version", _version),
            Route("/api/start", _start),
            Route("/api/sessions", _new_session, methods=["POST"]),
            WebSocketRoute("/api/sessions/{session}/live", _live),
            Route("/api/sessions/{session}/uploads", _upload, methods=["POST"]),
            Route("/api/sessions/{session}/files.zip", _files),
            Route("/api/sessions/{session}/scenes/{key}", _scene),
            Route("/api/jobs", _new_job, methods=["POST"]),
            Route("/api/jobs/{job}", _job),
            Route("/api/jobs/{job}/files/{path:path}", _job_file),
        ],
        exception_handlers={InputError: _refused},
        lifespan=lifespan,
    )
    app.state.sessions, app.state.jobs, app.state.settings = sessions, jobs, settings
    return _Guard(app, settings)


class _Guard:
    """Lets in who may, and adds headers that keep a page from doing what it need not."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app, self._settings = app, settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers, token = Headers(scope=scope), QueryParams(scope["query_string"]).get("token", "")
        why = self._refusal(scope, headers, token)
        if why and scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 4403, "reason": why})
            return
        if why:
            await JSONResponse({"sentence": why}, 403, headers=HEADERS)(scope, receive, send)
            return

        async def answer(message: Message) -> None:
            if message["type"] == "http.response.start":
                more = dict(HEADERS)
                if token:
                    more["set-cookie"] = f"{COOKIE}={token}; HttpOnly; SameSite=Strict; Path=/"
                message["headers"] = [*message["headers"], *((k.encode(), v.encode()) for k, v in more.items())]
            await send(message)

        await self._app(scope, receive, answer)

    def _refusal(self, scope: Scope, headers: Headers, token: str) -> str:
        """Why a request is refused; "" where it is not."""
        host, origin = headers.get("host", ""), headers.get("origin")
        if self._settings.hosts and host not in self._settings.hosts:
            return f"this server is not called {host[:80]!r}"
        asks = scope["type"] == "websocket" or scope["method"] not in ("GET", "HEAD")
        if origin is not None and asks and origin.partition("://")[2] != host:
            return "another site's page may not use this server"
        if not self._settings.token or scope.get("path", "").startswith("/static/"):
            return ""
        given = (
            token or Request(scope).cookies.get(COOKIE, "") if scope["type"] == "http" else token or _cookie(headers)
        )
        bearer = headers.get("authorization", "").removeprefix("Bearer ")
        if any(hmac.compare_digest(some.encode(), self._settings.token.encode()) for some in (given, bearer)):
            return ""
        return "this server needs its token: open the address that it printed when it was started"


def _cookie(headers: Headers) -> str:
    pairs = (part.strip().partition("=") for part in headers.get("cookie", "").split(";"))
    return next((value for name, _, value in pairs if name == COOKIE), "")


async def _refused(_: Request, error: Exception) -> Response:
    return JSONResponse({"sentence": str(error)}, 400)


def _missing(what: str) -> Response:
    return JSONResponse({"sentence": f"there is no such {what}"}, 404)


async def _page(_: Request) -> Response:
    return Response(STATIC.joinpath("studio.html").read_bytes(), media_type="text/html; charset=utf-8")


async def _static(request: Request) -> Response:
    name = request.path_params["name"]
    if name == "viewer.js":
        return Response(viewer_script(), media_type="text/javascript")
    if name == "viewer.css":
        return Response(viewer_style(), media_type="text/css")
    if name not in PAGES:
        return _missing("file")
    return Response(STATIC.joinpath(name).read_bytes(), media_type=TYPES[Path(name).suffix])


async def _version(_: Request) -> Response:
    from rodshell.version import __version__

    return JSONResponse({"rodshell": __version__})


async def _start(request: Request) -> Response:
    """What the page needs once: the keys of a case, the built-in cases, kinds of files, and the case to begin with."""
    keys = [vars(key) for key in case_keys().values()]
    first = request.app.state.sessions.first
    return JSONResponse(
        {"keys": keys, "presets": presets(), "surfaces": SURFACES, "outlines": OUTLINES, "first": first}
    )


async def _new_session(request: Request) -> Response:
    return JSONResponse({"id": request.app.state.sessions.new()}, 201)


def _session(request: Request | WebSocket) -> Session | None:
    session: Session | None = request.app.state.sessions.get(request.path_params["session"])
    return session


async def _live(socket: WebSocket) -> None:
    """Orders of a page, and the news of its session."""
    session = _session(socket)
    if session is None:
        await socket.close(4404, "there is no such session")
        return
    await socket.accept()
    news: asyncio.Queue[News] = asyncio.Queue()
    session.listeners.add(news.put_nowait)
    sender = None
    try:
        await _send(socket, {"kind": "session", "after": "connect", **vars(session.state)})
        sender = asyncio.create_task(_send_news(socket, news))
        while True:
            message = json.loads(await socket.receive_text())
            if error := _obey(session, message):
                await _send(socket, {"kind": "failed", "serial": message.get("serial", 0), "sentence": error})
            if message.get("kind") == "step":
                await _send(socket, {"kind": "session", "after": "step", **vars(session.state)})
            elif message.get("kind") == "case" and not message.get("live"):
                await _send(socket, {"kind": "history", "at": session.state.at, "count": len(session.state.cases)})
    except (WebSocketDisconnect, json.JSONDecodeError, RecursionError):
        pass
    finally:
        session.listeners.discard(news.put_nowait)
        if sender:
            sender.cancel()


async def _send(socket: WebSocket, message: dict[str, Any]) -> None:
    """As ASCII: a case that an earlier version kept may hold half of a surrogate pair, which UTF-8 does not have."""
    await socket.send_text(json.dumps(message, allow_nan=False))


async def _send_news(socket: WebSocket, news: asyncio.Queue[News]) -> None:
    with suppress(WebSocketDisconnect, RuntimeError):
        while True:
            item = await news.get()
            if item.kind == "files":
                continue
            scene = item.kind == "stage" and bool(item.content)
            await _send(socket, {"kind": item.kind, "serial": item.serial, **item.facts, "scene": scene})
            if scene:
                await socket.send_bytes(item.content)


def _obey(session: Session, message: dict[str, Any]) -> str:
    """What a page asks for; why not, in a sentence."""
    try:
        _refuse_unwritable(message)
        match message.get("kind"):
            case "case":
                session.show(int(message["serial"]), dict(message["case"]), live=bool(message.get("live")))
            case "step":
                session.step(int(message["by"]))
            case "keep":
                session.keep_variant(str(message["name"]))
            case "drop":
                session.drop_variant(str(message["name"]))
            case _:
                return "the page and the server are of different versions: load the page again"
    except InputError as error:
        return str(error)
    except (KeyError, TypeError, ValueError):
        return "the page and the server are of different versions: load the page again"
    return ""


async def _upload(request: Request) -> Response:
    session, largest = _session(request), request.app.state.settings.largest_upload
    if session is None:
        return _missing("session")
    name = upload_name(request.query_params.get("name", ""))
    size, place = 0, session.uploads / f".{secrets.token_hex(6)}"
    try:
        with place.open("wb") as file:
            async for chunk in request.stream():
                size += len(chunk)
                if size > largest:
                    raise InputError(f"{name} is larger than {largest / 1e6:g} MB: reduce it, or use the command line")
                file.write(chunk)
        place.replace(session.uploads / name)
    finally:
        place.unlink(missing_ok=True)
    return JSONResponse({"file": UPLOAD + name}, 201)


async def _files(request: Request) -> Response:
    """The files of the session's form, as ZIP."""
    session = _session(request)
    if session is None:
        return _missing("session")
    news: asyncio.Queue[News] = asyncio.Queue()
    session.listeners.add(news.put_nowait)
    try:
        serial = -1 - secrets.randbelow(1 << 30)
        session.files(serial)
        while (item := await news.get()).serial != serial or item.kind not in ("files", "failed"):
            pass
    finally:
        session.listeners.discard(news.put_nowait)
    if item.kind == "failed":
        return JSONResponse(dict(item.facts), 400)
    headers = {"content-disposition": 'attachment; filename="gridshell.zip"'}
    return Response(item.content, media_type="application/zip", headers=headers)


async def _scene(request: Request) -> Response:
    session = _session(request)
    scene = session and session.scene_of_variant(request.path_params["key"])
    return Response(scene, media_type="application/octet-stream") if scene else _missing("scene")


async def _new_job(request: Request) -> Response:
    body = b""
    async for chunk in request.stream():
        body += chunk
        if len(body) > LARGEST_CASE:
            raise InputError(f"a case may have {LARGEST_CASE / 1e6:g} MB at most")
    try:
        case = json.loads(body)
    except (ValueError, RecursionError):
        raise InputError(NO_CASE) from None
    if not isinstance(case, dict):
        raise InputError(NO_CASE)
    _refuse_unwritable(case)
    jobs: Jobs = request.app.state.jobs
    return JSONResponse({"id": jobs.add(_without_files(case))}, 202)


def _refuse_unwritable(case: dict[str, Any]) -> None:
    """What Python reads as JSON but cannot be sent back as JSON, or nests too deep for that."""
    level: list[Any] = [case]
    for _ in range(DEEPEST):
        level = [part for whole in level for part in _parts(whole)]
    if level:
        raise InputError(f"a case has at most {DEEPEST} tables and lists within one another")
    try:
        json.dumps(case, allow_nan=False, ensure_ascii=False).encode()
    except ValueError:
        raise InputError("a case must hold finite numbers and valid Unicode text") from None


def _parts(value: Any) -> list[Any]:
    """What a table or a list holds."""
    if isinstance(value, dict):
        return list(value.values())
    return value if isinstance(value, list) else []


def _without_files(case: dict[str, Any]) -> dict[str, Any]:
    """The case, if it names no files: those of the server are not to be read."""
    return with_uploads(case, {})


async def _job(request: Request) -> Response:
    job = request.app.state.jobs.get(request.path_params["job"])
    if not job:
        return _missing("job")
    return Response(json.dumps(job, allow_nan=False), media_type="application/json")  # any text, as ASCII


async def _job_file(request: Request) -> Response:
    path = request.app.state.jobs.file(request.path_params["job"], request.path_params["path"])
    if path is None:
        return _missing("file")
    return FileResponse(path, headers={"content-disposition": "attachment"})
