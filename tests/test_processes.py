"""A process that works for another does not outlive it."""

import subprocess
import sys
import time
from pathlib import Path

import psutil

PARENT = """
import time
from multiprocessing import get_context
from rodshell.threads import work_for_parent

def work(place):
    work_for_parent()
    with open(place, "w") as file:
        file.write("ready")
    time.sleep(600)

if __name__ == "__main__":
    child = get_context("spawn").Process(target=work, args=({place!r},))
    child.start()
    print(child.pid, flush=True)
    child.join()
"""


def test_a_process_ends_when_the_one_that_it_works_for_is_killed(tmp_path: Path) -> None:
    ready, script = tmp_path / "ready", tmp_path / "parent.py"
    script.write_text(PARENT.replace("{place!r}", repr(str(ready))))
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        child = psutil.Process(int(parent.stdout.readline()))
        end = time.monotonic() + 60.0
        while not ready.exists() and time.monotonic() < end:
            time.sleep(0.05)
        assert ready.exists()
        parent.kill()
    _, alive = psutil.wait_procs([child], timeout=20.0)
    for process in alive:
        process.kill()
    assert not alive
