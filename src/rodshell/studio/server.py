"""The studio's server: pages, sessions over WebSockets, and jobs for programs.

It answers requests and passes messages on; all computing is done in other processes. Whoever reaches it needs its
token; whoever reaches it through another site's page is refused, by the Origin and Host headers.
"""

import asyncio
import json
import secrets
from collections.abc import AsyncIterator, Callable
from contextlib import ExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, HTTPConnection, Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from rodshell.case.keys import case_keys
from rodshell.case.link import LARGEST, LARGEST_UPLOAD, OUTLINES, SURFACES, UPLOAD, require_small, upload_name
from rodshell.case.load_tables import usual_loads
from rodshell.errors import InputError
from rodshell.output.viewer import viewer_script, viewer_style
from rodshell.rods.section import TRADE_SIZES, size_text
from rodshell.studio.jobs import Jobs
from rodshell.studio.kept import Room
from rodshell.studio.session import Session, Sessions, presets
from rodshell.studio.worker import News
from rodshell.untrusted import limit, raised
from rodshell.version import __version__

STATIC = files("rodshell.studio").joinpath("static")
TYPES = {".js": "text/javascript", ".css": "text/css"}
_OURS = ("studio.js", "studio.css", "lil-gui.js", "lil-gui.css")
_FILES: dict[str, Callable[[], str | bytes]] = {name: STATIC.joinpath(name).read_bytes for name in _OURS}
_FILES |= {"viewer.js": viewer_script, "viewer.css": viewer_style}
DEEPEST = 20  # tables and lists of a case within one another
_NO_CASE = "the body must be a case as JSON, with the tables of a case file"
_OTHER_PAGE = "the page and the server are of different versions: load the page again"
NO_TOKEN = "this server needs its token: open the address that it printed when it was started"
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "font-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "content-security-policy": _POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}


@dataclass(frozen=True)
class Settings:
    """How a server runs.

    Args:
        folder: in which sessions and jobs are kept.
        hosts: names, with the port, by which it may be reached.
        token: that requests must bring; "": none is needed. once : another one, for a single request: the address that
            a browser was started with is seen by other users of the machine.
        key: which pages that brought a token keep in a cookie, and need no token then; default: the token.
        first: the case with which a session begins, and the files that it names.
        time_limit: of a job [s]; largest_upload : [bytes], before RODSHELL_LIMITS.
    """

    folder: Path
    hosts: tuple[str, ...]
    token: str = ""
    once: str = ""
    key: str = ""
    first: dict[str, Any] | None = None
    files: dict[str, bytes] | None = None
    time_limit: float = 120.0
    largest_upload: float = LARGEST_UPLOAD


def studio_app(settings: Settings) -> ASGIApp:
    """The server as an ASGI application."""
    first = settings.first or presets()["pavilion"]
    room = Room(settings.folder)
    sessions = Sessions(settings.folder / "sessions", first, settings.files or {}, settings.time_limit, room)
    jobs = Jobs(settings.folder / "jobs", settings.time_limit, room)

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        jobs.run_next()
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
        exception_handlers={InputError: _refused, OSError: _not_kept, ClientDisconnect: _refused},
        lifespan=lifespan,
    )
    app.state.sessions, app.state.jobs, app.state.settings = sessions, jobs, settings
    return _Guard(app, settings)


class _Guard:
    """Lets in who may, and adds headers that keep a page from doing what it need not."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app, self._settings, self._once = app, settings, settings.once

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        client = HTTPConnection(scope)
        cookie = f"rodshell-{(scope.get('server') or ('', ''))[1]}"  # a browser sends the cookies of all ports to each
        why, proved = self._refusal(client, cookie)
        if why and scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 4403, "reason": why})
            return
        if why:
            refused: Response = JSONResponse({"sentence": why}, 403)
            if why == NO_TOKEN and scope["path"] == "/":  # reached by a link from elsewhere: the page has its cookie
                refused = await _page(Request(scope), 403)
            refused.headers.update(HEADERS)
            await refused(scope, receive, send)
            return

        async def answer(message: Message) -> None:
            if message["type"] == "http.response.start":
                more = dict(HEADERS)
                if proved:
                    key = self._settings.key or self._settings.token
                    more["set-cookie"] = f"{cookie}={key}; HttpOnly; SameSite=Strict; Path=/"
                message["headers"] = [*message["headers"], *((k.encode(), v.encode()) for k, v in more.items())]
            await send(message)

        await self._app(scope, receive, answer)

    def _refusal(self, client: HTTPConnection, cookie: str) -> tuple[str, bool]:
        """Why a request is refused, "" where it is not; and whether its address has the token."""
        host, origin, settings = client.headers.get("host", ""), client.headers.get("origin"), self._settings
        if settings.hosts and host not in settings.hosts:
            return f"this server is not called {host[:80]!r}", False
        asks = client.scope["type"] == "websocket" or client.scope["method"] not in ("GET", "HEAD")
        if origin is not None and asks and origin.partition("://")[2] != host:
            return "another site's page may not use this server", False
        if not settings.token:
            return "", False
        token = client.query_params.get("token", "")
        if self._once and _same(token, self._once):
            self._once = ""
            return "", True
        if _same(token, settings.token):
            return "", True
        bearer, kept = client.headers.get("authorization", "").removeprefix("Bearer "), client.cookies.get(cookie, "")
        allowed = _same(bearer, settings.token) or _same(kept, settings.key or settings.token)
        return "" if allowed or client.scope["path"].startswith("/static/") else NO_TOKEN, False


def _same(given: str, wanted: str) -> bool:
    return secrets.compare_digest(given.encode("utf-8", "replace"), wanted.encode())


async def _refused(_: Request, error: Exception) -> Response:
    return JSONResponse({"sentence": str(error)}, 400)


def _why_not_kept(error: Exception) -> str:
    return f"the server cannot keep or read this ({getattr(error, 'strerror', None) or type(error).__name__})"


async def _not_kept(_: Request, error: Exception) -> Response:
    return JSONResponse({"sentence": _why_not_kept(error)}, 507)


def _missing(what: str) -> Response:
    return JSONResponse({"sentence": f"there is no such {what}"}, 404)


async def _page(_: Request, status: int = 200) -> Response:
    return Response(STATIC.joinpath("studio.html").read_bytes(), status, media_type="text/html; charset=utf-8")


async def _static(request: Request) -> Response:
    name = request.path_params["name"]
    if name not in _FILES:
        return _missing("file")
    return Response(_FILES[name](), media_type=TYPES[Path(name).suffix])


async def _version(_: Request) -> Response:
    return JSONResponse({"rodshell": __version__})


async def _start(request: Request) -> Response:
    """What the page needs once: the keys of a case, built-in cases and loads, sections, the case to begin with."""
    keys = [vars(key) for key in case_keys().values()]
    first = request.app.state.sessions.first
    known = {"surfaces": SURFACES, "outlines": OUTLINES, "presets": presets(), "usual": usual_loads("0", "0")}
    known["sold"] = {material: [size_text(size) for size in sizes] for material, sizes in TRADE_SIZES.items()}
    return JSONResponse({"keys": keys, "first": first, "largest": limit(LARGEST), **known})


async def _new_session(request: Request) -> Response:
    return JSONResponse({"id": request.app.state.sessions.new()}, 201)


def _session(request: Request | WebSocket) -> Session | None:
    session: Session | None = request.app.state.sessions.get(request.path_params["session"])
    return session


async def _live(socket: WebSocket) -> None:
    """Orders of a page, and the news of its session."""
    await socket.accept()  # also of one that is closed at once: else the page does not hear why
    session, news = _session(socket), asyncio.Queue[News]()
    if session is None:
        await socket.close(4404, "there is no such session")
        return
    try:
        hearing = socket.app.state.sessions.hearing(session, news.put_nowait)
    except InputError as reason:
        await socket.close(4429, str(reason))
        return
    with hearing, ExitStack() as stack, suppress(WebSocketDisconnect):  # the page has gone in the middle of a message
        page = next(session.pages)
        await _send(socket, {"kind": "session", "after": "connect", "page": page, **vars(session.state)})
        stack.callback(asyncio.create_task(_send_news(socket, news)).cancel)
        while (received := await socket.receive())["type"] == "websocket.receive":
            message: dict[str, Any] = {}
            try:
                message = _message(received)
                _refuse_unwritable(message)
                _obey(session, message)
            except InputError as reason:
                serial = message.get("serial")
                serial = serial if isinstance(serial, int) else 0
                await _send(socket, {"kind": "failed", "serial": serial, "sentence": str(reason)})
            if message.get("kind") == "step":
                await _send(socket, {"kind": "session", "after": "step", **vars(session.state)})
            elif message.get("kind") == "case" and not message.get("live"):
                await _send(socket, {"kind": "history", "at": session.state.at, "count": len(session.state.cases)})


async def _send(socket: WebSocket, message: dict[str, Any]) -> None:
    """As ASCII: a case that an earlier version kept may hold half of a surrogate pair, which UTF-8 does not have."""
    try:
        text = json.dumps(message, allow_nan=False)
    except ValueError:  # a figure is not finite
        text = json.dumps(json.loads(json.dumps(message), parse_constant=lambda _: None))
    await socket.send_text(text)


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


def _message(received: Message) -> dict[str, Any]:
    """What a page sent.

    Raises:
        InputError: it is not a table as JSON, or too large.
    """
    text = received.get("text")
    if text is None:
        raise InputError("a message must be text, not bytes")
    require_small(len(text))
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        raise InputError("a message must be JSON") from None
    if not isinstance(message, dict):
        raise InputError(_OTHER_PAGE)
    return message


def _obey(session: Session, message: dict[str, Any]) -> None:
    """Do what a page asks for.

    Raises:
        InputError: it cannot be done, or is nothing that a page asks for.
    """
    try:
        match message:
            case {"kind": "case", "serial": int(serial), "case": dict(case)}:
                session.show(serial, case, live=bool(message.get("live")))
            case {"kind": "step", "by": int(by)}:
                session.step(by)
            case {"kind": "keep", "name": str(name)}:
                session.keep_variant(name)
            case {"kind": "drop", "name": str(name)}:
                session.drop_variant(name)
            case _:
                raise InputError(_OTHER_PAGE)
    except OSError as reason:
        raise InputError(_why_not_kept(reason)) from None


async def _upload(request: Request) -> Response:
    session, usual = _session(request), request.app.state.settings.largest_upload
    if session is None:
        return _missing("session")
    name = upload_name(request.query_params.get("name", ""))
    size, place = 0, session.uploads / f".{secrets.token_hex(6)}"
    try:
        with place.open("wb") as file:
            async for chunk in request.stream():
                size += len(chunk)
                if size > limit(usual):
                    raise InputError(
                        f"{name} is larger than {limit(usual) / 1e6:g} MB: reduce it, or use the command line, "
                        f"{raised(usual, size)}"
                    )
                session.room(len(chunk))
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
    news = asyncio.Queue[News]()
    with request.app.state.sessions.hearing(session, news.put_nowait):
        serial = -1 - secrets.randbelow(1 << 30)
        session.files(serial)
        while (item := await news.get()).serial != serial or item.kind not in ("files", "failed"):
            pass
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
        require_small(len(body))
    try:
        case = json.loads(body)
    except (ValueError, RecursionError):
        raise InputError(_NO_CASE) from None
    if not isinstance(case, dict):
        raise InputError(_NO_CASE)
    _refuse_unwritable(case)
    jobs: Jobs = request.app.state.jobs
    uploads: Path | None = None
    if name := request.query_params.get("session"):
        if (session := request.app.state.sessions.get(name)) is None:
            return _missing("session")
        uploads = session.uploads
    return JSONResponse({"id": jobs.add(case, len(body), uploads)}, 202)


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
