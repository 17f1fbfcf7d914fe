"""`rodshell studio`: the live page, served from this machine."""

from pathlib import Path

import click

from rodshell.errors import InputError, OutputError

HOST = "Address to listen on; at any but this machine's own, a page needs the printed token."
LOOPBACK = ("127.0.0.1", "localhost", "::1")


@click.command()
@click.argument("name", metavar="[CASE|SURFACE]", default="pavilion")
@click.option("--host", default="127.0.0.1", show_default=True, help=HOST)
@click.option(
    "--port", type=click.IntRange(0, 65535), default=8731, show_default=True, help="Port to listen on; 0: any free one."
)
@click.option("--folder", help="Folder in which sessions are kept; default: the user's cache.")
@click.option("--time-limit", default="120 s", show_default=True, help="Of one job.")
@click.option("--no-browser", is_flag=True, help="Print the address and open no browser.")
def command(name: str, host: str, port: int, folder: str | None, time_limit: str, no_browser: bool) -> int:
    """Design a gridshell on a live page: drag, compare, download.

    It opens a browser on a page that this machine serves; NAME is a built-in case, a case file or a surface to begin
    with. Needs pip install "rodshell[studio]".
    """
    try:
        import uvicorn

        from rodshell.studio.server import Settings, studio_app
    except ImportError:
        raise InputError('the studio needs starlette and uvicorn: pip install "rodshell[studio]"') from None
    import secrets
    import socket
    import threading
    import webbrowser

    from rodshell.cli.options import seconds_of
    from rodshell.studio.start import first_case, sessions_folder

    case, contents = first_case(name)
    kept = Path(folder) if folder else sessions_folder()
    try:
        (kept / "sessions").mkdir(parents=True, exist_ok=True)
    except OSError as reason:
        raise OutputError(f"cannot keep sessions in {kept} ({reason.strerror}): give another --folder") from None
    listener = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except OSError as reason:
        raise InputError(
            f"port {port} of {host} cannot be used ({reason.strerror}): give --port 0 for a free one"
        ) from None
    port = listener.getsockname()[1]
    loopback = host in LOOPBACK
    token = "" if loopback else secrets.token_urlsafe(18)
    hosts = tuple(f"{known}:{port}" for known in ("127.0.0.1", "localhost", "[::1]")) if loopback else ()
    settings = Settings(kept, hosts, token, case, contents, seconds_of(time_limit) or 120.0)
    address = f"http://{f'[{host}]' if ':' in host else host}:{port}/{f'?token={token}' if token else ''}"
    click.echo(f"rodshell studio: {address} (Ctrl-C ends it)", err=True)
    if not no_browser:
        threading.Timer(1.0, webbrowser.open, [address]).start()
    config = uvicorn.Config(
        studio_app(settings), log_level="warning", use_colors=False, ws_max_size=4_000_000, lifespan="on"
    )
    uvicorn.Server(config).run(sockets=[listener])
    return 0
