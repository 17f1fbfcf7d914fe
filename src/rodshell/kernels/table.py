"""Every kernel that is called from Python, with the types of its arguments: what is compiled when a wheel is built.

A type is a letter and a number of dimensions, in C order: f float64, i int64, b bool, c complex128; f2 is an array
(n, m) of float64, f alone a number; ff is a pair of numbers. Kernels that only kernels call need no row.
"""

from collections.abc import Callable
from typing import Any

Kernel = Callable[..., Any]

# Kernels of joints, meshes, twist, warm starts and dynamics, which most forms do not call: modules, or single kernels
OF_SOME_JOBS = {
    "contact.modified_mass", "geometry.curves._on_curve", "joints.relative_rotation", "joints.ties", "rods.bend_twist",
    "rods.isotropic._isotropic_bend_twist", "solve.implicit_euler", "solve.newton_matrix", "targets.field_fitting",
    "targets.rim", "targets.smooth_field",
}  # fmt: skip

KERNELS: dict[str, dict[str, str]] = {
    "contact.modified_mass": {
        "_turn": "f3 i1 i1 b1 f2 f1",
    },
    "contact.static": {
        "_tangents": "f2 f2",
    },
    "formfinding.bound_drape": {
        "_mark": "i2 i1 b1",
    },
    "formfinding.finite_sections": {
        "_curvatures": "f2 f2 i2 b1",
    },
    "formfinding.pipeline": {
        "_edge_middles": "f2 i1 i1 i1 f1",
    },
    "formfinding.trim": {
        "_end_tangents": "f2 i1 i1 i1 f1",
    },
    "geometry.boxes": {
        "each_meets": "f3 f4",
    },
    "geometry.curves": {
        "_on_curve": "f1 f2 f1",
        "lagrange": "f2 f3 f1",
        "resampled": "f1 f3 i f1 f",
    },
    "geometry.frames": {
        "_dots": "f2 f2",
        "_units": "f2",
    },
    "joints.relative_rotation": {
        "_relative_rotation": "f2 i2 i2 f2 f3 c2 f1 f3 f3 f2 f3",
        "_respond": "f1 f f2 c1 f1 f2",
    },
    "joints.ties": {
        "_offset_tie": "f2 i2 i2 i1 f2 f1 f1 f3 f3 f2 f3",
    },
    "layout.flatgrid": {
        "_crossings": "f2 f",
    },
    "layout.mesh": {
        "_cut": "i2 i1 f1 i2 i1 i f1",
        "_divided": "f2 i1 f1 i1 i1 i",
        "_edges_and_bends": "i1 i1 f1",
        "_fixed": "i2 f2 f1 i1",
        "_spans": "i1 i1 f1 f2",
    },
    "model.assembly": {
        "_expand": "f1 f3 i1",
        "_pattern": "i1 i1 i1 i1",
        "_reduce": "f2 f3 i1 i",
        "_scatter": "f3 i2 i3 i1 i1 f3 i i f1",
    },
    "model.potential": {
        "_add_product": "f3 i2 f2 f2",
    },
    "nets.apron": {
        "_prolong": "f1 i2 b2 i1 f2",
        "_stretches": "f1 f1 b2 f2 f",
    },
    "nets.chebyshev": {
        "_interpolate": "f1 f1 f3 i1 b1 i1 f1 i1 f2",
        "_sharpest": "f3 b2",
    },
    "nets.compass": {
        "_begin_chords": "f1 i1 f2 f2 f2 f2 f2 f1",
        "_end_chords": "f2 i i1 f2 f2 f f1 f1 f2 f3",
        "_keep": "i2 f2 f2 f1 f1 f f3 b2",
        "_next_nodes": "f3 b2 f1 f1 i i i",
        "_still_going": "f2 i i1 i f2 f2 f1",
        "_towards": "f2 f2 f2 f2 ff f1 f2 f3 f f1 f1",
        "_turn_chords": "f1 i1 f2 f2 f2 f1 f2 f f1 f1 f2",
    },
    "nets.net_ends": {
        "_around_ends": "f1 f3 i2 f2 f3 f1 f1",
        "_by_squares": "f3 i2 f1 f1",
        "_connect": "b2 i2 i i b1 b2",
        "_extrapolate": "i1 f2 i1 f2 f f2 f1",
        "_narrow": "f1 f2 f3 f1 i1 f2 f2 b",
        "_runs": "b2",
        "_set_inside": "i2 f1 b2",
        "_squares": "f3 f1 f1",
    },
    "nets.net_extent": {
        "_want": "b2 f1 f1 i f1 f1 f f b2",
    },
    "nets.net_refinement": {
        "_add_change": "f3 f3 f",
        "_arms": "f3 f1 f1 i i",
        "_chosen": "f3 b2 i i i2",
        "_put_arms": "f2 i1 i i f3",
        "_rows_to_renew": "f3 i2 f2 f b2 f2",
        "_straighten": "f2 f2 f1 i1 f2 f1 f2 f3",
        "_sweep": "f3 f2 i2 f1 f2 f3 f1 f1 i i ff f3 b2 f2 f",
    },
    "rods.bend_twist": {
        "_bend_twist": "f2 i2 f2 f1 f2 f1 f3 f3 f1 f2 f3",
        "_transported": "f2 i2 f3 f3 f1 f3 f3 f1",
    },
    "rods.elements": {
        "_add_axial": "f2 i2 f1 f2",
        "_elongation": "f2 f2 i2 f1",
        "_strains": "f2 i2 f1",
        "_stretch": "f2 i2 f1 f1 f1 f1 b f2 f3",
    },
    "rods.isotropic": {
        "_isotropic_bend": "f2 i2 f1 f2 f3",
        "_isotropic_bend_twist": "f2 i2 f2 f1 f1 f3 f1 f2 f3",
    },
    "solve.implicit_euler": {
        "_add_free": "f f2 f3 i1 f2",
        "_mass_norm": "f1 f1",
    },
    "solve.newton_matrix": {
        "_add": "f3 i2 i1 i1 f3 b1 f2",
        "_add_blocks": "f2 f3 i1 i1 f3 b1 f2",
        "_factor": "f2 i i",
        "_solve": "f2 i i f2 i1 i1 f3 f1 f2",
        "_turn_whole": "f2 i i1 f3",
    },
    "solve.sparse_ldl": {
        "_backward": "i1 f1 i1 i1 i1 i1 f1 f1 f1 f1",
        "_backward_rows": "i1 f2 i1 i1 i1 i1 f1 f1 f1 f1",
        "_forward": "i1 f1 i1 f1 i1 i1 i1 i1 f1 f1 f1",
        "_forward_rows": "i1 f2 i1 f2 i1 i1 i1 i1 f1 f1 f1",
        "_dissect": "f2 i2 i1 i1",
        "_numeric": "i1 f1 i1 i1 i1 i1 i1 i2 i1 i1 i1 i1 i1 f1 f1 f1 f1 f1",
        "_residual": "i1 i1 f1 f1 f1",
        "_without_spans": "i1 i1",
    },
    "solve.symbolic": {
        "_children": "i1 i1",
        "_block_rows": "i1 i1 i1",
        "_coupled": "i1 i1 i1 i1",
        "_fronts": "i1 i1 i1 i1",
        "_maps": "i1 i1 i1 i1 i1 i1 i1 i1 i1 i1 i1 i1 i1 i1",
        "_supernodes": "i1 i1 i1",
        "_tree": "i1 i1 i1 i1",
    },
    "targets.field_fitting": {
        "_curvatures": "f2 f2 i2 f2 f3 f2 f f3 f2",
        "_fit": "f2 f3 f i1 i1 f2 f2 f1 f2",
        "_means": "f2 f2 i2 f2 f3 f2 f f2 f2",
    },
    "targets.quadric": {
        "_implicit": "f2 f1 f f",
        "_level": "f2 f1 f f",
    },
    "targets.rim": {
        "_feet": "f2 f2 i1 i1 i1 f2 f1 i1 f1",
        "_find_roots": "f2 f1 f f1",
    },
    "targets.smooth_field": {
        "_blend": "f2 f1 i1 f i1 i1 f1 f2 f b f1 f2 f3",
        "_lattice_over": "f2 f",
        "_most_within": "f2 f2 f1 i1 f i1 i1 f",
        "_nearest": "f2 f2 f1 i1 f i1 i1 i f f1 i1",
        "_sorted": "f2 f1 i1 f",
        "_thin": "f2 f1 i1 f i1 i1 f b1",
        "_within": "f2 f2 f1 i1 f i1 i1 f b i1 i1 f1",
    },
    "targets.target": {
        "along_gradient": "f2 f1 f2",
        "newton_to_closest": "f2 f2 i1 f1 f2 f3 f1 f f2 f1",
        "offset_shape": "f3 f1",
        "shape_operators": "f2 f3 f2 f2 f3",
    },
}
