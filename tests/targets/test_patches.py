"""The smooth field of a mesh: exact derivatives, the order of the fit, and the way it goes on past a rim."""

from functools import cache

import numpy as np
import pytest

from rodshell.targets import Freeform
from rodshell.targets.field_fitting import _ring, fit_field
from rodshell.targets.samples import Samples
from rodshell.targets.smooth_field import SmoothField
from tests.targets.meshes import PARTS, Floats, capped_sphere, sheet, strewn


@cache
def field(name: str) -> SmoothField:
    return Freeform.of(*PARTS[name]()).field


def around(patches: SmoothField, off: float, count: int = 300) -> Floats:
    """Points up to `off` spacings off the patches, on both sides and past the rim too."""
    rng = np.random.default_rng(3)
    chosen = rng.integers(0, len(patches.centres), count)
    return patches.centres[chosen] + patches.spacing * rng.uniform(-off, off, (count, 3))


@pytest.mark.parametrize("off", [0.5, 3.0])
@pytest.mark.parametrize("name", PARTS)
def test_gradient_and_hessian_are_derivatives(name, off):
    """Taylor: what is left of F falls with the third power of the step, of its gradient with the second."""
    patches = field(name)
    x = around(patches, off)
    way = np.random.default_rng(4).normal(size=x.shape) * patches.spacing
    here = patches.implicit(x)
    value, slope = [], []
    for h in (0.04, 0.02, 0.01):
        there = patches.implicit(x + h * way)
        along = np.einsum("ni,ni->n", here.gradient, h * way)
        bent = np.einsum("nij,nj->ni", here.hessian, h * way)
        value.append(np.abs(there.value - here.value - along - 0.5 * np.einsum("ni,ni->n", bent, h * way)).sum())
        slope.append(np.abs(there.gradient - here.gradient - bent).sum())
    assert np.log2(value[1] / value[2]) == pytest.approx(3, abs=0.2)
    assert np.log2(slope[1] / slope[2]) == pytest.approx(2, abs=0.2)


def test_hessian_is_symmetric():
    patches = field("bowl")
    h = patches.implicit(around(patches, 2.0)).hessian
    assert np.array_equal(h, h.transpose(0, 2, 1))


def test_field_is_that_of_plain_sums():
    """A twin straight from the definition: all patches, weights of |x - c|^2 alone."""
    patches = field("saddle")
    x = around(patches, 1.0, 50)
    d = x[:, None] - patches.centres
    local = np.einsum("mij,nmj->nmi", patches.frames, d)
    a, b = local[..., 0] / patches.spacing, local[..., 1] / patches.spacing
    terms = np.stack([1 + 0 * a, a, b, a * a, a * b, b * b, a**3, a * a * b, a * b * b, b**3])
    q = local[..., 2] - np.einsum("mk,knm->nm", patches.coefficients, terms)
    w = np.exp(-np.sum(d * d, axis=-1) / (0.5 * patches.spacing) ** 2)
    exact = np.sum(w * q, axis=1) / np.sum(w, axis=1)
    # weights below exp(-20) of the largest are left out, 2e-9 each, of some hundred patches that differ by a spacing
    assert np.abs(patches.implicit(x).value - exact).max() < 1e-7 * patches.spacing


def test_far_from_every_patch_there_is_no_field():
    patches = field("bowl")
    far = patches.centres[:1] + [[0.0, 0.0, 2.0 * patches.reach], [0.0, 0.0, 0.3 * patches.reach], [np.nan, 0.0, 0.0]]
    assert np.isnan(patches.implicit(far).value).tolist() == [True, False, True]


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "order"), [("value", 4), ("normal", 3), ("curvature", 2)])
def test_fit_to_a_sphere_converges(kind, order):
    """Cubics miss a sphere by the fourth power of their size, its normals by the third, its curvature by the second.

    An even surface gains an order in places; half an order less is allowed for, as patches never lie alike. Coarser
    meshes, whose vertices would be more than 1e-4 of the size off, get more patches for their vertices.
    """
    error = []
    for rows in (40, 80):
        x, faces = capped_sphere(rows, np.radians(100))
        patches = Freeform.of(x, faces).field
        z = np.random.default_rng(1).uniform(0.2, 1, 400)
        angle = np.random.default_rng(2).uniform(0, 2 * np.pi, 400)
        n = np.column_stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z])
        value, gradient, hessian = patches.implicit(n)
        steep = np.linalg.norm(gradient, axis=1)
        tangent = np.eye(3) - n[:, :, None] * n[:, None, :]
        miss = {
            "value": value,
            "normal": gradient / steep[:, None] - n,
            "curvature": tangent @ (hessian / steep[:, None, None]) @ tangent - tangent,
        }
        error.append(np.sqrt(np.mean(np.square(miss[kind]))))
    assert np.log2(error[0] / error[1]) > order - 0.5, error


@pytest.mark.parametrize("name", ["saddle", "bowl"])
def test_a_quadric_is_met_to_its_own_curvature(name):
    """Over tangent planes a paraboloid is no polynomial, but nearly: 2e-6 of the size measured."""
    height = {"saddle": lambda x, y: (x**2 - y**2) / 0.8, "bowl": lambda x, y: 0.1 - x**2 - 0.5 * y**2 + 0.2 * x * y}[
        name
    ]
    x, y = np.random.default_rng(0).uniform(-0.13, 0.13, (2, 200))
    points = np.column_stack([x, y, height(x, y)])
    assert np.abs(field(name).implicit(points).value).max() < 1e-5 * 0.2


def test_a_sphere_goes_on_past_its_rim():
    """Curvature carried on: 0.25 R past the rim of a half ball the surface is off the sphere by some thousandths,
    as curvature fades 1.5 rad past the rim; a tangent cone would be 0.03 R off."""
    x, faces = capped_sphere(40, np.pi / 2)
    target = Freeform.of(x, faces)
    for depth, allowed in ((0.1, 4e-4), (0.25, 4e-3)):
        angle = np.linspace(0, 2 * np.pi, 50)
        below = np.column_stack(
            [np.cos(depth) * np.cos(angle), np.cos(depth) * np.sin(angle), np.full(50, -np.sin(depth))]
        )
        assert np.abs(target.implicit(below).value).max() < allowed
        assert target.margin(target.retract(below)) == pytest.approx(-depth, rel=0.02)


def test_curvature_is_continuous_across_the_rim():
    """On the line through a rim the second derivative does not jump: steps of a hundredth of a spacing."""
    target = Freeform.of(*PARTS["bowl"]())
    s = np.linspace(-3, 3, 2401) * target.field.spacing
    line = np.column_stack([0.2 + s, 0 * s, 0 * s])
    line[:, 2] = 0.1 - line[:, 0] ** 2
    h = target.implicit(line).hessian[:, 0, 0]
    assert np.abs(np.diff(h)).max() < 0.02 * np.ptp(h)


def test_no_sheet_rolls_up_past_a_tightly_curved_rim():
    """A wave that ends where it bends most, with a radius of 0.05 of the size: no more than a right angle is turned."""
    target = Freeform.of(*sheet(lambda x, y: 0.004 * np.cos(x / 0.014), 0.2, 90))
    turned = np.arccos(np.clip(target.field.frames[:, 2, 2], -1, 1))
    steepest = np.arctan(0.004 / 0.014)
    assert turned.max() < steepest + np.pi / 2


def test_points_strewn_at_random_give_nearly_the_field_of_a_lattice():
    def height(x, y):
        return 0.05 * np.cos(8 * x) * np.cos(6 * y)

    even, strewn_one = Freeform.of(*sheet(height, 0.2, 60)), Freeform.of(*strewn(height, 0.2, 4000))
    x, y = np.random.default_rng(5).uniform(-0.17, 0.17, (2, 300))
    points = np.column_stack([x, y, height(x, y)])
    for target, allowed in ((even, 2e-5), (strewn_one, 6e-5)):
        assert np.abs(target.implicit(points).value).max() < allowed * 0.2


def test_a_field_of_points_alone_needs_no_mesh():
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-1, 1, (2, 3000))
    points = np.column_stack([x, y, 0.3 * x * y])
    normals = np.column_stack([-0.3 * y, -0.3 * x, 1 + 0 * x])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    patches, own = fit_field(Samples(points, normals, np.full(3000, 4 / 3000)), 0.1, past=0.3, reach=1.0)
    assert own < len(patches.centres)
    assert np.abs(patches.implicit(points).value).max() < 1e-4


@pytest.mark.parametrize("off", [0.1, 1.0, 3.0])
def test_points_may_come_in_any_order_and_number(off):
    """Neighbours in a row share a list of patches; strangers do not, and each has the field that it has alone."""
    patches = field("torus")
    x = around(patches, off, 200)
    path = x[:50, None] + patches.spacing * np.linspace(0, 1.5, 7)[:, None] * [1, 0, 0]  # short walks, and jumps
    x = np.vstack([x, path.reshape(-1, 3)])
    whole, order = patches.implicit(x), np.random.default_rng(5).permutation(len(x))
    size = np.abs(whole.hessian).max()
    assert patches.implicit(x[order]).hessian == pytest.approx(whole.hessian[order], abs=1e-11 * size)
    level = patches.implicit(x, second=False)
    assert level.value == pytest.approx(whole.value, abs=1e-14)
    assert level.gradient == pytest.approx(whole.gradient, abs=1e-12)
    for k in range(0, len(x), 29):
        assert patches.implicit(x[k : k + 1]).hessian[0] == pytest.approx(whole.hessian[k], abs=1e-11 * size)


def test_a_new_patch_lies_in_the_mean_of_what_its_neighbours_say():
    """Three level patches in a row, the outer two higher by 0.2 spacings: between two of them it is half way up."""
    centres = np.array([[-1.0, 0.0, 0.2], [0.0, 0.0, 0.0], [1.0, 0.0, 0.2]])
    patches = SmoothField(centres, np.tile(np.eye(3), (3, 1, 1)), np.zeros((3, 10)), 1.0, 5.0)
    added = _ring(patches, np.array([[0.5, 0.0, 0.7], [0.0, 0.3, 0.0]]))
    near, far = np.exp(-np.array([0.5**2 + 0.5**2, 1.5**2 + 0.5**2]) / 1.44)
    above = np.exp(-(0.5**2 + 0.7**2) / 1.44)
    assert added.centres[0] == pytest.approx([0.5, 0.0, 0.2 * (near + far) / (near + far + above)])
    assert added.frames[:, 2] == pytest.approx(np.tile([0.0, 0.0, 1.0], (2, 1)))
    assert not added.coefficients.any()
