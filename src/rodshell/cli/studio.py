"""`rodshell studio`: the live page, served from this machine."""

import secrets
import socket
import threading
import webbrowser
from pathlib import Path

import click

from rodshell.case.link import LARGEST
from rodshell.cli.options import seconds_of
from rodshell.errors import InputError
from rodshell.untrusted import limit

_HOST = "Address to listen on."
NO_TOKEN = "Let in all users of this machine, also without the token in the printed address."
_LOOPBACK = ("127.0.0.1", "localhost", "::1")


@click.command()
@click.argument("name", metavar="[CASE|SURFACE]", default="pavilion")
@click.option("--host", default="127.0.0.1", show_default=True, help=_HOST)
@click.option(
    "--port", type=click.IntRange(0, 65535), default=8731, show_default=True, help="Port to listen on; 0: any free one."
)
@click.option("--folder", help="Folder in which sessions are kept; default: the user's cache.")
@click.option("--time-limit", default="120 s", show_default=True, help="Of one job.")
@click.option("--no-browser", is_flag=True, help="Print the address and open no browser.")
@click.option("--no-token", is_flag=True, help=NO_TOKEN)
def command(
    name: str, host: str, port: int, folder: str | None, time_limit: str, no_browser: bool, no_token: bool
) -> int:
    """Design a gridshell on a live page: drag, compare, download.

    It opens a browser on a page that this machine serves; NAME is a built-in case, a case file or a surface to begin
    with. Needs pip install "rodshell[studio]".
    """
    try:
        import uvicorn

        from rodshell.studio.server import Settings, studio_app
    except ImportError:
        raise InputError('the studio needs starlette and uvicorn: pip install "rodshell[studio]"') from None
    from rodshell.studio.start import first_case, own_folder, sessions_folder

    loopback = host in _LOOPBACK
    if no_token and not loopback:
        raise InputError(f"--no-token: other machines reach --host {host}: leave one of the two out")
    case, contents = first_case(name)
    kept = Path(folder) if folder else sessions_folder()
    key = own_folder(kept)
    listener = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen()  # who reads the address can use it
    except OSError as reason:
        raise InputError(
            f"port {port} of {host} cannot be used ({reason.strerror}): give --port 0 for a free one"
        ) from None
    port = listener.getsockname()[1]
    token, once = ("", "") if no_token else (secrets.token_urlsafe(18), secrets.token_urlsafe(18))
    hosts = tuple(f"{known}:{port}" for known in ("127.0.0.1", "localhost", "[::1]")) if loopback else ()
    settings = Settings(kept, hosts, token, once, key, case, contents, seconds_of(time_limit) or 120.0)
    printed, opened = (
        f"http://{f'[{host}]' if ':' in host else host}:{port}/{f'?token={given}' if given else ''}"
        for given in (token, once)
    )
    click.echo(f"rodshell studio: {printed} (Ctrl-C ends it)", err=True)
    if not no_browser:
        threading.Timer(1.0, webbrowser.open, [opened]).start()
    config = uvicorn.Config(
        studio_app(settings),
        log_level="warning",
        use_colors=False,
        ws_max_size=int(4 * limit(LARGEST)),  # what is larger than a case, but not by much, is refused in a sentence
        lifespan="on",
        timeout_graceful_shutdown=5,
    )
    uvicorn.Server(config).run(sockets=[listener])
    return 0
