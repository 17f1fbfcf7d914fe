"""The checks of several shells as of one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from rodshell.checks.check import Checks
from rodshell.checks.contact import Contact, worst_contact
from rodshell.checks.deployment import Deployment
from rodshell.checks.other_shapes import OtherShapes
from rodshell.checks.self_weight import weakest
from rodshell.formfinding.popup import Ends


@dataclass(frozen=True)
class MergedChecks(Checks):
    """The checks of several shells, which are `named`, as of one."""

    named: Mapping[str, Checks] = field(kw_only=True)

    @property
    def warnings(self) -> tuple[str, ...]:
        words = [
            f"patch {name}: {word}"
            for name, one in self.named.items()
            for word in one.warnings
            if word not in (one.out_of_time, *one.tight)
        ]
        late = (self.out_of_time,) if self.out_of_time else ()
        return (*late, *words, *self.tight)


def merged_checks(named: Mapping[str, Checks], contacts: Mapping[Ends, Contact]) -> MergedChecks:
    """Of shells that share nothing: what all were checked for, one after the other.

    The deployment has the stages that all were followed through. Each shell bears its own weight by itself, what they
    share being held as supports are: of all the smallest factor counts.

    contacts : of all final shapes together, by end condition; in a deployment each shell is looked at by itself.
    """
    parts = list(named.values())
    ends = [one for one in parts[0].bending if all(one in part.bending for part in parts)]

    def each(table: str) -> dict[Ends, Any]:
        return {end: _stacked([getattr(part, table)[end] for part in parts]) for end in ends}

    both = [end for end in ends if all(end in part.self_weight for part in parts)]
    weighed = {end: weakest([part.self_weight[end] for part in parts]) for end in both}
    late = next((part.stopped for part in parts if part.stopped), "")
    missing = tuple(dict.fromkeys(word for part in reversed(parts) for word in part.missing))  # the last lacks the most
    contact = {end: contacts[end] for end in ends}
    all_searched = [end for end in ends if all(end in part.other_shapes for part in parts)]
    others = {end: _searched([part.other_shapes[end] for part in parts]) for end in all_searched}
    bending, held, joints = each("bending"), each("reactions"), each("joints")
    ways = [part.deployment for part in parts if part.deployment is not None]
    if len(ways) < len(parts):
        return MergedChecks(
            bending, held, joints, None, (), weighed, contact, (), others, None, late, missing, named=named
        )
    shared = [share for share in ways[0].share.tolist() if all(share in one.share for one in ways)]
    rows = [[one.share.tolist().index(share) for share in shared] for one in ways]
    bent = tuple(
        _stacked([part.on_the_way[row[k]] for part, row in zip(parts, rows, strict=True)]) for k in range(len(shared))
    )
    way, turned = _joined_ways(ways, rows), _all([part.clamped_from_flat for part in parts])
    found = {
        name: [part.contact_on_the_way[k] for k in row] for (name, part), row in zip(named.items(), rows, strict=True)
    }
    met = tuple(worst_contact({name: stages[k] for name, stages in found.items()}) for k in range(len(shared)))
    return MergedChecks(
        bending, held, joints, way, bent, weighed, contact, met, others, turned, late, missing, named=named
    )


def _joined_ways(ways: Sequence[Deployment], rows: Sequence[list[int]]) -> Deployment:
    """The ways up of several shells at the shares that all reached, their `rows`."""
    lost = [one.lost_at for one in ways if one.lost_at is not None]
    elsewhere = [one.elsewhere for one in ways if one.elsewhere is not None]
    return Deployment(
        ways[0].share[rows[0]],
        np.concatenate([one.positions[row] for one, row in zip(ways, rows, strict=True)], axis=1),
        (),
        tuple(sorted({snap for one in ways for snap in one.snaps}, key=lambda snap: snap.start)),
        max(lost, default=None),
        _all([one.reached_from_flat for one in ways]),
        max(elsewhere, key=lambda one: one.distance, default=None),
        max((one.guided for one in ways if one.guided is not None), default=None),
        sum(one.factorizations for one in ways),
    )


def _all(answers: Sequence[bool | None]) -> bool | None:
    """Whether all are true; None where that is not known."""
    return False if False in answers else None if None in answers else True


def _searched(parts: Sequence[OtherShapes]) -> OtherShapes:
    """The searches of several shells as one: each found the other shapes of its own shell."""
    return OtherShapes(
        sum(one.tried for one in parts),
        any(one.popped_through for one in parts),
        max(one.largest_kick for one in parts),
        tuple(shape for one in parts for shape in one.found),
        sum(one.factorizations for one in parts),
    )


def _stacked(parts: Sequence[Any]) -> Any:
    """Records of arrays, joined array by array; None where one part has none."""
    columns = [[getattr(part, field.name) for part in parts] for field in fields(parts[0])]
    return type(parts[0])(
        *(None if any(one is None for one in column) else np.concatenate(column) for column in columns)
    )
