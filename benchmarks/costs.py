"""Costs: files over the number of rods, contact over a form, targets of any kind over the dome."""

import os
import tempfile

import numpy as np

import rodshell as rs
from benchmarks.rows import Row, Section, clock
from rodshell.checks.contact import contact_of
from rodshell.layout import FlatGrid, FlatRod, mesh_grid
from rodshell.output.files import export
from rodshell.results import Archive, Results
from tests.acceptance.targets import SAME, gallery, gallery_target
from tests.output.sample_archive import with_deployment

ROD = rs.Rod(rs.Circle(5e-4), rs.Material(1e6, 1e3))


def costs(quick: bool) -> Section:
    """Seconds of processors. Files: a vault of ten rods, crossed by ever more. Contact: a hemisphere of 121 rods each
    way. Targets: from the file to the pop-ups with about 30 rods each way."""
    times = 1 if quick else 3
    return Section("Costs", " ".join((costs.__doc__ or "").split()), [_files(quick), _contact(), *_targets(times)])


def _files(quick: bool) -> Row:
    rods, seconds = list[int](), list[float]()
    for across in (10, 30, 60) if quick else (10, 30, 60, 110):
        archive = vault(across)
        rods.append(len(archive.results.plain()["rods"]))
        seconds.append(_to_export(archive))
    slope = float(np.polyfit(np.log(rods), np.log(seconds), 1)[0])
    each = ", ".join(f"{count} rods {time:.2f} s" for count, time in zip(rods, seconds, strict=True))
    return Row("all files of a vault: slope of time over rods, log-log", f"{slope:.2f} ({each})", "at most 1.25")


def vault(across: int) -> Archive:
    """Ten long rods and `across` short ones over a cylinder: as many joints on every short rod."""
    length, width = 0.03 * (across + 1), 0.33
    rods = [FlatRod.u(f"U{k + 1:02}", 0.03 * (k - 4.5), 0.0, length) for k in range(10)]
    rods += [FlatRod.v(f"V{k + 1:03}", 0.03 * (k + 1), -width / 2, width / 2) for k in range(across)]
    mesh = mesh_grid(FlatGrid.of(rods), 0.005)
    bent = np.column_stack([mesh.flat[:, 0], 0.2 * np.sin(mesh.flat[:, 1] / 0.2), 0.2 * np.cos(mesh.flat[:, 1] / 0.2)])
    ends = mesh.ends.ravel()
    joints: list[list[dict[str, object]]] = [[] for _ in rods]
    for (a, b), at in zip(mesh.grid.crossings.rods.tolist(), mesh.grid.crossings.at.tolist(), strict=True):
        joints[a].append({"with": rods[b].name, "at": at[0] - rods[a].start})
        joints[b].append({"with": rods[a].name, "at": at[1] - rods[b].start})
    entries = [
        {"id": rod.name, "family": rod.family, "offset": rod.offset, "start": rod.start, "end": rod.end,
         "length": rod.length, "joints": met}
        for rod, met in zip(rods, joints, strict=True)
    ]  # fmt: skip
    result = {"format": "rodshell-result", "version": 1, "status": "converged", "name": "vault", "rods": entries,
              "footprint": mesh.flat[ends, :2].tolist(), "boundary": bent[ends].tolist()}  # fmt: skip
    states = {"flat": mesh.flat, "popped_pinned": bent, "rod_nodes": mesh.rod_nodes, "rod_start": mesh.rod_start}
    return with_deployment(Archive(Results.of(result), states), 9)


def _to_export(archive: Archive) -> float:
    """Seconds of an export and of the processes that help it."""
    with tempfile.TemporaryDirectory() as folder:
        start = sum(os.times()[:4])
        export(archive, folder)
        return sum(os.times()[:4]) - start


def _contact() -> Row:
    """What contact costs, of a form of 121 rods each way."""
    spacing = 0.62 / 120
    begin = clock()
    form = rs.find_form(rs.Hemisphere(0.2), rs.GridLayout.orthogonal(spacing=spacing, edge=spacing / 3), ROD)
    formed = clock()
    for popped in form.popped.values():
        contact_of(popped.shell, popped.state, ROD)
    share = (clock() - formed) / len(form.popped) / (formed - begin)
    what = f"{len(form.footprint.rods)} rods, {len(form.footprint.mesh.edges)} edges: contact of a shape over the form"
    return Row(what, f"{100 * share:.1f} %", "at most 10 %")


def _targets(times: int) -> list[Row]:
    """Whole jobs over the dome's; the dome's among the others', so that a busy machine delays all alike."""
    found = {name: list[tuple[float, str]]() for name in gallery()}
    for name in times * list(found):
        found[name].append(_whole_job(name))
    least = {name: min(jobs) for name, jobs in found.items()}
    dome = least["dome"][0]
    return [
        Row(f"{name}: whole job over the dome's", f"{seconds / dome:.2f} ({seconds:.2f} s, {said})", "at most 3")
        for name, (seconds, said) in least.items()
        if name != "dome"
    ]


def _whole_job(name: str) -> tuple[float, str]:
    """Seconds from the file to the pop-ups with about 30 rods each way; how many there are, and the status."""
    piece = gallery()[name]
    coarse = rs.chebyshev_net(piece.target, piece.layout(), anchor=piece.anchor)
    lines = {family: len({rod.offset for rod in coarse.rods if rod.family == family}) for family in "uv"}
    across, along = (piece.spacing * lines[family] / 30 for family in "uv")
    edge = min(float(np.sqrt(across * along)) / 4, across, along)
    layout = rs.GridLayout.orthogonal(spacing=(across, along), edge=edge, rotate=piece.rotate)
    begin = clock()
    form = rs.find_form(gallery_target(name), layout, SAME, anchor=piece.anchor)
    seconds = clock() - begin
    families = [rod.family for rod in form.footprint.rods]
    return seconds, f"{families.count('u')} x {families.count('v')} rods, {form.status}"
