"""What beams along the edge of a shell use of their strength."""

from dataclasses import replace
from math import pi

import numpy as np

from rodshell.arrays import largest_at
from rodshell.figures.loads import UsedBeam
from rodshell.loads.settings import Strength
from rodshell.loads.strength import bending_under, preset_limits, utilisation
from rodshell.model import Shell
from rodshell.model.edge_beam import FittedBeam
from rodshell.rods.design_strength import Duration
from rodshell.solve.equilibrium import Equilibrium


def with_creep(shell: Shell, service_class: int | None) -> Shell:
    """The shell with the creep of each beam that it was not given for, by the preset of its material."""
    known = [preset_limits(beam.rod, service_class).creep if beam.creep is None else beam.creep for beam in shell.beams]
    beams = (replace(beam, creep=creep) for beam, creep in zip(shell.beams, known, strict=True))
    return replace(shell, beams=tuple(beams))


def used_beams(shell: Shell, found: Equilibrium, asked: Strength, duration: Duration | None) -> tuple[UsedBeam, ...]:
    """Forces, stress and utilisation of the beams of a shell in an equilibrium, its source frames being there.

    Args:
        asked: effective lengths, and the service class of timber; strengths are those of a beam's own preset.
        duration: of the loads; None: there are none.
    """
    names = shell.mesh.grid.support_names
    used = list[UsedBeam]()
    for beam in shell.beams:
        alone, state = _alone(beam), found.state[beam.blocks]
        forces, limits = beam.forces(found.state), preset_limits(beam.rod, asked.service_class)
        bent = bending_under(alone, state, beam.rod, forces, limits)
        overrides = replace(asked, slip=None, hole=0.0)
        shares = utilisation(
            alone, state, beam.rod, forces=forces, limits=limits, asked=overrides, duration=duration, bent=bent
        )
        buckling = pi**2 * min(beam.rod.bend_stiffnesses) / (asked.effective_length * beam.mesh.edge_lengths) ** 2
        where = largest_at(np.zeros(1) if bent.stress is None else bent.stress)
        used.append(
            UsedBeam(
                name=beam.along.name,
                tension=max(0.0, float(forces.max())),
                compression=max(0.0, -float(forces.min())),
                max_stress=None if bent.stress is None else float(bent.stress.max()),
                max_stress_at=names[beam.along.ends[where % len(beam.along.ends)]],
                utilisation=max(shares.largest.values(), default=None),
                euler=float((np.maximum(-forces, 0.0) / buckling).max()),
            )
        )
    return tuple(used)


def _alone(beam: FittedBeam) -> Shell:
    """The beam as a shell of one rod, its source frames being where they are."""
    shell = Shell.of(beam.mesh, beam.rod, isotropic=False)
    (bend,) = shell.within
    return shell.with_elements((replace(beam.bend, blocks=bend.blocks),))
