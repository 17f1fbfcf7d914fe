"""A material of one's own, with its strengths: tubes of flax fibres in a plant resin, which creep more than glass.

A form needs its stiffness and its mass; a check, which stress it withstands for how long. Most of the stress of such a
shell is that of its bent rods, E r / R, and stays in them for years.
"""

import rodshell as rs

flax = rs.Material(youngs_modulus=28e9, density=1330.0, shear=2.1e9)
TESTED = 280e6  # Pa, in bending, of minutes
strength = rs.Strength(permanent=0.3 * TESTED, short=0.6 * TESTED)  # under loads of years, and of days

tube = rs.Rod(rs.Tube(radius=0.02, thickness=0.004), flax)
layout = rs.GridLayout.orthogonal(spacing=1.6, edge=0.8)
form = rs.find_form(rs.Cap(radius=10.0, base=5.0), layout, tube, ends="clamped")
acting = {"weight": rs.SelfWeight(), "snow": rs.Snow(50.0)}
combinations = {"summer": {"weight": 1.35}, "winter": {"weight": 1.35, "snow": 1.5}}
loads = rs.Loads(loads=acting, combinations=combinations, strength=strength)
found = rs.check_loads(form, loads)
for name, shells in found.shells.items():
    print(f"{name}: {shells['clamped'].utilisation:.0%} of the strength used")
bent = flax.youngs_modulus * tube.section.outer_radius * form.archive().states["curvature_clamped"].max()
print(f"by E r / R alone: {bent / strength.permanent:.0%}")
assert bent / strength.permanent < found.shells["summer"]["clamped"].utilisation < 1.05 * bent / strength.permanent
