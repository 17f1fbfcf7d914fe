"""Strips of 20 x 2 mm upright on a saddle, along its asymptotic lines, which do not bend out of the surface.

On a minimal surface such as Scherk's these lines cross at right angles, and the strips lie flat together.
"""

import rodshell as rs

target = rs.HeightField(formula="0.8*(log(cos(y/0.8)) - log(cos(x/0.8)))", domain=rs.Disc(0.9))
strip = rs.Rod(rs.RectangularSection(width=0.020, height=0.002), rs.Material.preset("gfrp"))
form = rs.find_form(target, rs.Asymptotic(spacing=0.15), strip, joint=rs.Pin(), ends="pinned", anchor=(0.0, 0.0))
gap, bent = form.agreement["pinned"], form.checks.bending["pinned"]
print(f"{len(form.footprint.rods)} strips: {gap}")
assert form.popped["pinned"].report.stable
assert form.flat_state is not None
print(f"in the plane: {form.flat_state}")
assert form.flat_state.lies_flat
assert gap.max_relative < 0.0005
assert abs(bent.normal_curvature).max() < 0.05 * abs(bent.geodesic_curvature).max()
