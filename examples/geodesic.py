"""Laths of 2 x 40 mm along geodesics of a dome, where they are straight when developed; along a net they buckle.

They bend 400 times as easily out of the surface as within it. The dome is too high for its laths to lie flat together.
"""

import rodshell as rs

target = rs.Cap(radius=2.0, base=1.0)
lath = rs.Rod(rs.RectangularSection(width=0.002, height=0.040), rs.Material.preset("gfrp"))
net = rs.find_form(target, rs.GridLayout.orthogonal(spacing=0.3), lath, joint=rs.Pin(), ends="pinned")
print(f"along a net: {net.status}")
form = rs.find_form(target, rs.Geodesic(spacing=0.3), lath, joint=rs.Pin(), ends="pinned")
gap, flat = form.agreement["pinned"], form.flat_state
print(f"along geodesics, {len(form.footprint.rods)} laths: {gap}")
assert net.status != "converged"
assert form.popped["pinned"].report.stable
assert gap.max_relative < 0.002
assert flat is not None
assert not flat.lies_flat
