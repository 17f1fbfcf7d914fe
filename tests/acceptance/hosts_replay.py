"""What the script of an OpenSees model finds, as JSON: `python hosts_replay.py SCRIPT MODEL`, with openseespy alone."""

import importlib.util
import json
import sys
from typing import Any


def replayed(script: str, model: str) -> dict[str, Any]:
    """Shape and forces before bracing, cables, frequencies and limits after it."""
    spec = importlib.util.spec_from_file_location("replay", script)
    assert spec
    assert spec.loader
    replay = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(replay)
    with open(model, encoding="utf-8") as file:
        shell = replay.Replay(json.load(file))
    shell.deploy()
    found = {"positions": shell.positions().tolist(), "forces": shell.forces().tolist(), "cables": []}
    if shell.given["cables"]:
        shell.brace()
        found["cables"] = shell.cable_forces().tolist()
    found["frequencies"] = shell.frequencies(3).tolist()
    acting = shell.given["loads"] or {"own weight": shell.own_weight()}
    found["limits"] = {name: shell.limit(forces) for name, forces in acting.items()}
    return found


if __name__ == "__main__":
    print("FOUND", json.dumps(replayed(*sys.argv[1:])))
