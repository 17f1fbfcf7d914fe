"""The process that runs jobs: a task a line in, a reply a line out.

It is started with one thread for each library, loads the kernels once, and ends with the process that started it.
"""

import json
import os
import signal
import sys
import threading
from queue import SimpleQueue
from time import process_time
from typing import Any, TextIO

from rodshell.errors import OutputError, RodshellError
from rodshell.job import Job
from rodshell.sweeps.columns import row_of
from rodshell.sweeps.identity import program_version
from rodshell.sweeps.store import FOUND

SMALL = {"layout.rods": "5x5", "layout.spacing": "80 mm", "layout.edge": "40 mm"}


def main() -> None:
    """Read tasks and reply to each, until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches every process; the coordinator decides
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what libraries print goes to stderr
    tasks = SimpleQueue[str]()
    threading.Thread(target=_read, args=(tasks,), daemon=True).start()
    Job.load("hemisphere", SMALL).run()  # loads the kernels, so that the time of the first job is that of a job
    _reply(replies, {})  # it is ready
    while True:
        _reply(replies, reply_to(json.loads(tasks.get())))


def _read(tasks: "SimpleQueue[str]") -> None:
    for line in sys.stdin:
        tasks.put(line)
    os._exit(0)  # the parent is gone: nobody waits for the job that runs


def _reply(replies: TextIO, content: dict[str, Any]) -> None:
    replies.write(json.dumps(content) + "\n")
    replies.flush()


def reply_to(task: dict[str, Any]) -> dict[str, Any]:
    """Run a task of `Computation`: {"outcome", "row"}; {"mismatch"} of versions; {"unwritten"} for an unsaved form."""
    if task["version"] != program_version():
        return {"mismatch": program_version()}
    begun = process_time()
    try:
        form = Job.load(task["case"]).run(until=task["until"])
        checked = task["until"] == "fabrication"
        results = form.archive().results if checked else form.results()
        row = row_of(results, verdict=form.verdict if checked else None, seconds=process_time() - begun)
    except RodshellError as error:
        return {"outcome": "refused", "row": {"status": _line(error), "seconds": process_time() - begun}}
    except Exception as error:
        said = f"{type(error).__name__}: {_line(error)}"
        return {"outcome": "failed", "row": {"status": said, "seconds": process_time() - begun}}
    if task["archive"] is not None:
        try:
            form.save(task["archive"], kinds=["report"])
        except OutputError as error:
            return {"unwritten": _line(error)}
    return {"outcome": FOUND, "row": row}


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())
