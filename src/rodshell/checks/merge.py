"""The checks of several patches, merged into those of one shell."""

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
    """The checks of all patches together; `patches` holds those of each by its name."""

    patches: Mapping[str, Checks] = field(kw_only=True)

    @property
    def warnings(self) -> tuple[str, ...]:
        words = [
            f"patch {name}: {word}"
            for name, checks in self.patches.items()
            for word in checks.warnings
            if word not in (checks.out_of_time, *checks.tight)
        ]
        late = (self.out_of_time,) if self.out_of_time else ()
        return (*late, *words, *self.tight)


def merged_checks(patches: Mapping[str, Checks], contacts: Mapping[Ends, Contact]) -> MergedChecks:
    """Checks of patches that share no rod: the results that all of them have, one patch after the other.

    The deployment has the stages that every patch was followed through. Each patch carries its own weight by itself,
    its seams being held as supports are: the smallest factor counts.

    Parameters
    ----------
    patches : checks of each patch by its name, in the order of their meshes.
    contacts : of all final shapes together, by end condition; during the deployment each patch is looked at by itself.
    """
    parts = list(patches.values())
    ends = [end for end in parts[0].bending if all(end in part.bending for part in parts)]

    def stacked(table: str) -> dict[Ends, Any]:
        return {end: _stacked([getattr(part, table)[end] for part in parts]) for end in ends}

    def known(table: str) -> list[Ends]:
        return [end for end in ends if all(end in getattr(part, table) for part in parts)]

    deployed = all(part.deployment is not None for part in parts)
    return MergedChecks(
        bending=stacked("bending"),
        reactions=stacked("reactions"),
        joints=stacked("joints"),
        self_weight={end: weakest([part.self_weight[end] for part in parts]) for end in known("self_weight")},
        contact={end: contacts[end] for end in ends},
        other_shapes={end: _searched([part.other_shapes[end] for part in parts]) for end in known("other_shapes")},
        stopped=next((part.stopped for part in parts if part.stopped), ""),
        # the last patch lacks the most
        missing=tuple(dict.fromkeys(word for part in reversed(parts) for word in part.missing)),
        patches=patches,
        **(_merged_deployment(patches) if deployed else {}),
    )


def _merged_deployment(patches: Mapping[str, Checks]) -> dict[str, Any]:
    """What the checks of the deployment say, by field, at the shares that all patches reached."""
    parts = list(patches.values())
    ways = [part.deployment for part in parts if part.deployment is not None]
    shares = [share for share in ways[0].share.tolist() if all(share in way.share for way in ways)]
    rows = [[way.share.tolist().index(share) for share in shares] for way in ways]
    contacts = {
        name: [part.deployment_contact[row] for row in of_patch]
        for (name, part), of_patch in zip(patches.items(), rows, strict=True)
    }
    return {
        "deployment": _merged_stages(ways, rows),
        "deployment_bending": tuple(
            _stacked([part.deployment_bending[of_patch[k]] for part, of_patch in zip(parts, rows, strict=True)])
            for k in range(len(shares))
        ),
        "deployment_contact": tuple(
            worst_contact({name: stages[k] for name, stages in contacts.items()}) for k in range(len(shares))
        ),
        "clamped_from_flat": _all([part.clamped_from_flat for part in parts]),
    }


def _merged_stages(ways: Sequence[Deployment], rows: Sequence[list[int]]) -> Deployment:
    """The deployments of several patches at the shares that all reached, their `rows`."""
    lost = [way.lost_at for way in ways if way.lost_at is not None]
    elsewhere = [way.elsewhere for way in ways if way.elsewhere is not None]
    return Deployment(
        share=ways[0].share[rows[0]],
        positions=np.concatenate([way.positions[row] for way, row in zip(ways, rows, strict=True)], axis=1),
        shells=(),
        snaps=tuple(sorted({snap for way in ways for snap in way.snaps}, key=lambda snap: snap.start)),
        lost_at=max(lost, default=None),
        reached_from_flat=_all([way.reached_from_flat for way in ways]),
        elsewhere=max(elsewhere, key=lambda shape: shape.distance, default=None),
        guided=max((way.guided for way in ways if way.guided is not None), default=None),
        factorizations=sum(way.factorizations for way in ways),
    )


def _all(answers: Sequence[bool | None]) -> bool | None:
    """Whether all are true; None where that is not known."""
    return False if False in answers else None if None in answers else True


def _searched(parts: Sequence[OtherShapes]) -> OtherShapes:
    """The searches of several patches as one: each found the other shapes of its own shell."""
    return OtherShapes(
        tried=sum(part.tried for part in parts),
        popped_through=any(part.popped_through for part in parts),
        largest_kick=max(part.largest_kick for part in parts),
        found=tuple(shape for part in parts for shape in part.found),
        factorizations=sum(part.factorizations for part in parts),
    )


def _stacked(parts: Sequence[Any]) -> Any:
    """Records of arrays, joined array by array; None where one part has none."""
    columns = [[getattr(part, field.name) for part in parts] for field in fields(parts[0])]
    return type(parts[0])(
        *(None if any(array is None for array in column) else np.concatenate(column) for column in columns)
    )
