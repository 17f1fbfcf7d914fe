"""A sample archive made from formulas: no computed shell, but every key of a result."""

from itertools import pairwise
from typing import Any

import numpy as np

from rodshell.results import Archive, Results

RADIUS = 0.2  # m
LENGTH = 0.5 * np.pi * RADIUS  # of the flat state's radius: rim to top along a meridian [m]

CASE = f"""[target]
kind = "hemisphere"
radius = {RADIUS}

[layout]
rods = [9, 9]
spacing = [0.07, 0.07]
edge = 0.01
"""


def sample_archive(count: int = 9, edges: int = 6) -> Archive:
    """A dome of `count` rods in each family, with `edges` edges between two joints.

    The flat state is a disc; a meridian keeps its length, so that rods of different offsets differ in length.
    """
    offsets = np.linspace(-1, 1, count) * LENGTH * (1 - 0.9 / count)
    rods = _rods(offsets)
    flat, rod_nodes, rod_start = _mesh(rods, offsets, edges)
    states = {
        "flat": flat,
        "draped": dome(flat, 0.0),
        "popped_pinned": dome(flat, 1.0),
        "popped_clamped": dome(flat, 0.1),
        "rod_nodes": rod_nodes,
        "rod_start": rod_start,
    }
    for end, state in (("draped", "draped"), ("pinned", "popped_pinned"), ("clamped", "popped_clamped")):
        states[f"gap_{end}"] = np.linalg.norm(states[state], axis=1) - RADIUS
    return Archive(Results.of(_result(rods, states)), states, CASE)


def table_archive() -> Archive:
    """Four free rods from a table, popped up with pinned ends: no target, no footprint, no case."""
    ends = np.array([[[-0.3, -0.2], [0.3, -0.1]], [[-0.3, 0.1], [0.3, 0.25]], [[-0.2, -0.35], [-0.1, 0.35]],
                     [[0.2, -0.35], [0.1, 0.35]]])  # fmt: skip
    names, crossings, shares = ["A", "B", "C <1>", "D"], {}, np.linspace(0, 1, 41)
    for a in (0, 1):
        for b in (2, 3):
            sides = np.column_stack([ends[a, 1] - ends[a, 0], ends[b, 0] - ends[b, 1]])
            crossings[a, b] = np.linalg.solve(sides, ends[b, 0] - ends[a, 0])
    rods: list[dict[str, Any]] = []
    points: list[np.ndarray] = []
    for k, name in enumerate(names):
        length = float(np.linalg.norm(ends[k, 1] - ends[k, 0]))
        met = [
            (names[b if k == a else a], float(st[int(k == b)]) * length)
            for (a, b), st in crossings.items()
            if k in (a, b)
        ]
        rods.append({"id": name, "family": "free", "start": 0.0, "end": length, "length": length,
                     "joints": [{"with": other, "at": at} for other, at in met]})  # fmt: skip
        own = np.sort(np.concatenate([shares, [at / length for _, at in met]]))
        points.append(ends[k, 0] + own[:, None] * (ends[k, 1] - ends[k, 0]))
    plane = np.concatenate(points)
    flat = np.column_stack([plane, np.zeros(len(plane))])
    popped = np.column_stack([0.9 * plane, 0.12 * np.cos(3 * plane[:, 0]) * np.cos(3 * plane[:, 1])])
    counts = [len(each) for each in points]
    return Archive(
        Results.of({"format": "rodshell-result", "version": 1, "units": "SI", "status": "converged",
         "name": "table of rods", "rods": rods,
         "pop_up": {"pinned": {"status": "converged", "stable": True, "dofs": 500}}}),
        {"flat": flat, "popped_pinned": popped, "rod_nodes": np.arange(len(flat)),
         "rod_start": np.cumsum([0, *counts[:-1]])},
        "",
    )  # fmt: skip


def dome(flat: np.ndarray, bulge: float) -> np.ndarray:
    """Flat points (n, 3) laid along the hemisphere's meridians, off it by `bulge` times 1 % of R or less."""
    r = np.hypot(flat[:, 0], flat[:, 1])
    share = r / LENGTH
    off = RADIUS * (1 + bulge * (0.06 * share**2 * (1 - share) - 0.006 * (1 - share**2)))
    angle = r / RADIUS
    ring = np.divide(off * np.sin(angle), r, out=np.ones_like(r), where=r > 0)
    return np.column_stack([ring * flat[:, 0], ring * flat[:, 1], off * np.cos(angle)])


def _rods(offsets: np.ndarray) -> list[dict[str, Any]]:
    rods = []
    for family, other in (("u", "v"), ("v", "u")):
        for k, offset in enumerate(offsets):
            half = float(np.sqrt(LENGTH**2 - offset**2))
            joints = [
                {"with": f"{other.upper()}{j + 1:02}", "at": float(at + half)}
                for j, at in enumerate(offsets) if abs(at) < half
            ]  # fmt: skip
            rods.append({"id": f"{family.upper()}{k + 1:02}", "family": family, "offset": float(offset),
                         "start": -half, "end": half, "length": 2 * half, "joints": joints})  # fmt: skip
    return rods


def _mesh(rods: list[dict[str, Any]], offsets: np.ndarray, edges: int) -> tuple[np.ndarray, ...]:
    """Nodes at joints, at ends and between; rods share a node at a joint."""
    points: list[tuple[float, float, float]] = []
    shared: dict[tuple[str, str], int] = {}
    rod_nodes, rod_start = [], []
    for rod in rods:
        rod_start.append(len(rod_nodes))
        met = {joint["at"] + rod["start"]: joint["with"] for joint in rod["joints"]}
        stops = sorted({rod["start"], rod["end"], *met})
        between = [np.linspace(a, b, edges + 1)[:-1] for a, b in pairwise(stops)]
        for s in [*np.concatenate(between), rod["end"]]:
            node = shared.get((met.get(float(s), "none"), rod["id"]))
            if node is None:
                node = len(points)
                points.append(
                    (float(s), rod["offset"], 0.0) if rod["family"] == "u" else (rod["offset"], float(s), 0.0)
                )
                if float(s) in met:
                    shared[rod["id"], met[float(s)]] = node
            rod_nodes.append(node)
    return np.array(points), np.array(rod_nodes), np.array(rod_start)


def _result(rods: list[dict[str, Any]], states: dict[str, np.ndarray]) -> dict[str, Any]:
    rod_nodes = np.split(states["rod_nodes"], states["rod_start"][1:])
    ends = np.array([own[[0, -1]] for own in rod_nodes]).ravel()
    pop_up = {"status": "converged", "iterations": 9, "factorizations": 11, "dofs": 3 * len(states["flat"]),
              "seconds": 1.25, "force_residual": 3.1e-12, "stable": True, "negative_modes": 0}  # fmt: skip
    return {
        "format": "rodshell-result", "version": 1, "units": "SI", "status": "converged",
        "name": "sample dome", "version_rodshell": "0.1.0",
        "target": {"kind": "hemisphere", "radius": RADIUS, "size": RADIUS},
        "layout": {"rods": [9, 9], "spacing": [0.07, 0.07], "length": "auto", "edge": 0.01, "rotate": 0.0,
                   "offset": [0.0, 0.0]},
        "rod": {"section": {"kind": "circle", "radius": 1e-3},
                "material": {"youngs_modulus": 1e6, "poisson_ratio": 0.5, "density": 1000.0}},
        "rods": rods,
        "footprint": states["flat"][ends, :2].tolist(), "boundary": states["draped"][ends].tolist(),
        "agreement": {end: _agreement(states, end) for end in ("pinned", "clamped")},
        "net": {"error_estimate": 2e-6, "min_angle_deg": 41.5, "min_angle_at": [0.12, 0.12, 0.02]},
        "drape": {"method": "bound", "dofs": 1234, "seconds": 0.5, "force_residual": 1e-9,
                  "max_strain": 2e-12, "max_gap": 1e-15, "negative_modes": 0, "min_angle_deg": 41.5,
                  "levels": [{"dofs": 640, "iterations": 4, "factorizations": 4},
                             {"dofs": 1234, "iterations": 3, "factorizations": 3}],
                  "net_deviation": {"max": 1.2e-4, "median": 3e-5}},
        "pop_up": {"pinned": dict(pop_up), "clamped": dict(pop_up)},
    }  # fmt: skip


def _agreement(states: dict[str, np.ndarray], end: str) -> dict[str, Any]:
    gap = np.abs(states[f"gap_{end}"])
    top, rms = float(gap.max()), float(np.sqrt(np.mean(gap**2)))
    return {"max": top, "rms": rms, "max_relative": top / RADIUS, "rms_relative": rms / RADIUS,
            "where": states[f"popped_{end}"][int(gap.argmax())].tolist()}  # fmt: skip


def with_deployment(archive: Archive, stages: int = 9) -> Archive:
    """The archive with a deployment from flat, stresses and a check: shapes of the right size, not equilibria."""
    flat, final = archive.states["flat"], archive.states["popped_pinned"]
    share = np.linspace(0, 1, stages) ** 2
    rise = np.array([0.0, 0.0, 1.0])
    history = np.array([(1 - s) * flat + s * final + 0.05 * s * (1 - s) * rise for s in share])
    entries = len(archive.states["rod_nodes"])
    stress = np.abs(np.sin(np.arange(entries) / 50))
    states = archive.states | {
        "history": history, "history_share": share,
        "history_stress": np.outer(share, stress).astype(np.float32),
        "stress_pinned": stress, "stress_clamped": 0.8 * stress,
    }  # fmt: skip
    rows = [{"share": float(s), "height": float(np.ptp(x[:, 2]))} for s, x in zip(share, history, strict=True)]
    results = Results.of({**archive.results.plain(), "deployment": {"ends": "pinned", "stages": rows}})
    return Archive(results, states, archive.case_toml)


def with_everything() -> Archive:
    """A dome of three rods in each family with every array and nearly every table; figures of the right kind."""
    made = with_deployment(sample_archive(3, 2), stages=4)
    result, states = made.results.plain(), dict(made.states)
    entries, rods = len(states["rod_nodes"]), result["rods"]
    for ends in ("pinned", "clamped"):
        states |= {
            f"curvature_{ends}": np.linspace(0, 1, entries), f"force_{ends}": np.linspace(-1, 1, entries),
            f"loaded_{ends}_snow": 1.01 * states[f"popped_{ends}"], f"loaded_stress_{ends}_snow": np.ones(entries),
            f"loaded_mode_{ends}_snow": 0.01 * states["flat"], f"loaded_buckling_{ends}_snow_1": 0.01 * states["flat"],
        }  # fmt: skip
    states |= {
        "history_curvature": states["history_stress"], "target_points": states["draped"].astype(np.float32),
        "target_faces": np.array([[0, 1, 2], [1, 2, 3]], dtype=np.uint32),
    }  # fmt: skip
    for k, rod in enumerate(rods):
        rod |= {"cut_length": rod["length"] + 0.02, "mass": 0.01, "layer": 1 + k % 2, "min_radius": 0.1,
                "max_stress": 1e6, "utilisation": 0.4, "splices": [rod["length"] / 2]}  # fmt: skip
    rods[0]["stiffness"] = {"at": [0.0, rods[0]["length"]], "factors": [1.0, 2.0], "varies": "size",
                            "sizes": [0.002, 0.003]}  # fmt: skip
    ids, point = [rod["id"] for rod in rods], [0.0, 0.0, 1.0]
    forces, place = 2 * len(rods) * [point], {"rod": ids[0], "at": 0.1}
    loaded = {
        "at_factor": 1.0, "load_sum": point, "reaction_sum": point, "max_deflection": 0.01, "linear_factor": 3.0,
        "limit_factor": 2.0, "limit_kind": "limit point", "imperfect_factor": 1.5, "imperfect_kind": "bifurcation",
        "duration": "short", "utilisation": 0.3, "utilisations": {"bending": 0.3, "shear": 0.1}, "euler": 0.2,
        "euler_at": place, "max_stress": 1e6, "governs": {**place, "by": "bending"}, "uplift": 1.0,
        "reactions": forces, "support_forces": forces, "support_moments": forces, "bracing": [1.0, 2.0],
        "mode_factors": [3.0], "frequencies": [1.0],
    }  # fmt: skip
    reactions = {"force_sum": point, "moment_sum": point, "largest_force": 1.0, "forces": forces, "moments": forces}
    bars = [{"pieces": [{"piece": name, "length": 0.1} for name in ids], "left": 0.1}]
    joints = [f"{ids[0]}/{ids[3]}", f"{ids[1]}/{ids[4]}"]
    result |= {
        "bending": {"strength": 1e7, "pinned": {**place, "max_stress": 1e6, "min_radius": 0.1, "utilisation": 0.2}},
        "reactions": {ends: dict(reactions) for ends in ("pinned", "clamped")},
        "joint_loads": {"pinned": [{"rods": [ids[0], ids[3]], "force": point, "normal_force": 1.0, "shear_moment": 1.0,
                                    "out_of_plane_moment": 1.0, "scissor_deg": 2.0}]},
        "self_weight": {"pinned": {"load_factor": 3.0, "deflection": 0.01, "limit": "limit point"}},
        "loads": {"snow": {"pinned": dict(loaded), "clamped": dict(loaded)}},
        "contact": {"pinned": {"clearance": 0.01, "pairs": 0, "rods": ids[:2], "where": point}},
        "other_shapes": {"pinned": {"tried": 3, "found": [{"distance": 0.1, "energy": 1.1, "mirror": True}]}},
        "end_tangents": forces, "dropped": [{"id": "X", "reason": "short"}],
        "verdict": {"level": "good", "reasons": ["It pops up."]}, "strength": {"permanent": 1e7, "short": 2e7},
        "joint": {"kind": "pin", "eccentricity": 0.0, "mass": 0.0},
        "drawings": {"paper": "A3", "project": "dome", "layers": {"CUT": "cut"}, "date": "2026-11-22"},
        "fabrication": {"end_allowance": 0.01, "stock_length": 1.0, "kerf": 0.003, "total_mass": 1.0,
                        "bracing": [{"from": joints[k], "to": joints[1 - k], "flat": 0.04, "final": 0.05, "cut": 0.05}
                                    for k in (0, 1)],
                        "stock": {"waste": 0.1, "fewest": 1, "bars": bars}},
        "seams": [{"points": [[0.0, 0.0], [0.1, 0.1]],
                   "meetings": [{"ends": [f"{ids[0]}.0", f"{ids[1]}.1"], "point": [-0.1, 0.0, 0.1]}],
                   "forces": {"pinned": {"each": [point], "largest": 1.0, "sum": point}}}],
    }  # fmt: skip
    result["deployment"] |= {"snaps": [[0.1, 0.2]], "snapped_by": [0.1], "reached_from_flat": True}
    return Archive(Results.of(result), states, made.case_toml)
