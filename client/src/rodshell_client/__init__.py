"""Ask a rodshell studio on the same machine for gridshells.

`rodshell studio` prints an address with a token. A `Client` of that address sends cases, as a case file has them but as
dicts, and gives back forms: lines, nested lists of them, findings, files. It needs nothing but Python 3.9.

    client = Client("http://127.0.0.1:8731/?token=TOKEN")
    form = client.find({"target": {"kind": "cap"}})
    form.lines["U01"]  # points (x, y, z) [m]
"""

import json
import time
import urllib.error
import urllib.parse
import urllib.request

__version__ = "0.2.0"
ANSWER = 20.0  # s within which the server says anything at all
PAUSES = (0.05, 1.0)  # s between two looks at a job: the first, and the longest


class ServerError(Exception):
    """The server cannot be used, or found no form; the sentence says why and what to do."""


class Client:
    """A rodshell studio.

    Args:
        address: as the studio prints it, with its token.
        token: where the address has none; "" for a studio that was started with --no-token.

    Raises:
        ServerError: no studio answers there, or one of another version.
    """

    def __init__(self, address="http://127.0.0.1:8731/", token=""):
        parts = urllib.parse.urlsplit(address.strip())
        if parts.scheme not in ("http", "https") or not parts.netloc:
            raise ServerError(
                "the address must be one such as http://127.0.0.1:8731/?token=TOKEN, which `rodshell studio` prints, "
                "not " + repr(address)
            )
        self.address = f"{parts.scheme}://{parts.netloc}/"
        self._token = token or urllib.parse.parse_qs(parts.query).get("token", [""])[0]
        self._open = urllib.request.build_opener(urllib.request.ProxyHandler({})).open
        self.server = self._json("api/version").get("rodshell", "")
        if self.server.split(".")[:2] != __version__.split(".")[:2]:
            raise ServerError(
                "the studio at {0} is rodshell {1}, and this client is for {2}: install rodshell-client {1}".format(
                    self.address, self.server or "of an unknown version", __version__
                )
            )

    def find(self, case, files=None, wait=600.0):
        """The form of a case.

        Args:
            case: tables of a case file as dicts; a target's file is named "upload:roof.obj".
            files: contents, bytes or text, of the files that it names, by their names, such as {"roof.obj": text}.
            wait: for at most so long [s].

        Raises:
            ServerError: the case is refused, no form was found, or the server is gone or busy.
        """
        path = "api/jobs"
        if files:
            session = self._json("api/sessions", b"")["id"]
            for name, content in files.items():
                data = content if isinstance(content, bytes) else content.encode("utf-8")
                asked = urllib.parse.urlencode({"name": name})
                self._json(f"api/sessions/{session}/uploads?{asked}", data)
            path += "?" + urllib.parse.urlencode({"session": session})
        job = self._json(path, json.dumps(case).encode("utf-8"))["id"]
        pause, most = PAUSES
        until = time.monotonic() + wait
        while True:
            status = self._json("api/jobs/" + job)
            if status["status"] == "done":
                return Form(self, job, status)
            if status["status"] == "failed":
                raise ServerError(status["sentence"])
            if time.monotonic() > until:
                raise ServerError(
                    "the studio at {} is busy: after {:g} s this form is {}; wait longer, or end other jobs".format(
                        self.address, wait, "still waiting" if status["status"] == "queued" else "not found yet"
                    )
                )
            time.sleep(pause)
            pause = min(2 * pause, most)

    def _json(self, path, body=None):
        try:
            found = json.loads(self._bytes(path, body).decode("utf-8"))
        except ValueError:
            found = None
        if not isinstance(found, dict):
            raise ServerError(f"what answers at {self.address} is no rodshell studio: give another address")
        return found

    def _bytes(self, path, body=None):
        """The answer to a request; with a body it is a POST."""
        headers = {"Authorization": "Bearer " + self._token} if self._token else {}
        request = urllib.request.Request(self.address + path, body, headers)
        try:
            with self._open(request, timeout=ANSWER) as answer:
                return answer.read()
        except urllib.error.HTTPError as refused:
            raise ServerError(_sentence(refused, self.address)) from None
        except OSError as reason:
            slow = "timed out" in str(reason)
            raise ServerError(
                f"the studio at {self.address} is busy: it did not answer within {ANSWER:g} s; try again"
                if slow
                else f"no studio answers at {self.address}: start `rodshell studio` and give the address that it prints"
            ) from None


def _sentence(refused, address):
    """What the server says of a request that it refuses."""
    try:
        return str(json.loads(refused.read().decode("utf-8"))["sentence"])
    except (ValueError, KeyError, TypeError):
        return f"the studio at {address} failed ({refused.code}): see what it printed"


class Form:
    """A form that was found.

    Args:
        result: the content of result.json, in SI units.
        files: names of its files, for `file`.
    """

    def __init__(self, client, job, status):
        self._client, self._job = client, job
        self.result, self.files = status["result"], status["files"]
        self._model = None

    def __repr__(self):
        return "<rodshell form {}: {}, {} rods>".format(self.result.get("name"), self.verdict, len(self.result["rods"]))

    def file(self, name):
        """The bytes of one of its files, such as "drawings/plan.dxf"."""
        if name not in self.files:
            raise ServerError("this form has no file {!r}: it has {}".format(name, ", ".join(self.files)))
        return self._client._bytes(f"api/jobs/{self._job}/files/{urllib.parse.quote(name)}")

    @property
    def model(self):
        """The final shape, as the COMPAS file has it: "rods", "grid" and "cells"."""
        if self._model is None:
            names = [name for name in self.files if name.startswith("model/") and name.endswith(".json")]
            if not names:
                raise ServerError("no shape in space was found: {}".format("; ".join(self.reasons) or self.verdict))
            self._model = json.loads(self.file(names[0]).decode("utf-8"))
        return self._model

    @property
    def lines(self):
        """Points (x, y, z) [m] along each rod in the final shape, by its id."""
        return {rod["name"]: [tuple(point) for point in rod["data"]["points"]] for rod in self.model["rods"]}

    @property
    def flat(self):
        """Both ends (x, y, 0) [m] of each rod in the flat grid, by its id."""
        ends = [(point[0], point[1], 0.0) for point in self.result["footprint"]]
        return {rod["id"]: ends[2 * k : 2 * k + 2] for k, rod in enumerate(self.result["rods"])}

    @property
    def joints(self):
        """The place (x, y, z) [m] of each joint, by its id."""
        vertices = self.model["cells"]["data"]["vertex"].values()
        return {vertex["joint"]: (vertex["x"], vertex["y"], vertex["z"]) for vertex in vertices}

    def tree(self, of=None):
        """Nested lists: for each family of rods its rods, of each what `of` has by the rod's id, such as `form.flat`;
        None: its line."""
        of = self.lines if of is None else of
        families = {}
        for rod in self.result["rods"]:
            if rod["id"] in of:
                families.setdefault(rod["family"], []).append(of[rod["id"]])
        return list(families.values())

    @property
    def verdict(self):
        """ "good", "check", "unbuildable" or "unknown"."""
        return (self.result.get("verdict") or {}).get("level", "unknown")

    @property
    def reasons(self):
        """Sentences, the most serious first."""
        return list((self.result.get("verdict") or {}).get("reasons", []))

    @property
    def findings(self):
        """Dicts with "code", "level" and figures."""
        return list((self.result.get("verdict") or {}).get("findings", []))


def obj_text(vertices, faces):
    """A mesh as the text of an OBJ file: points (x, y, z), and corners of each face counted from 0."""
    lines = ["v {!r} {!r} {!r}".format(*map(float, point)) for point in vertices]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in faces]
    return "\n".join(lines) + "\n"
