"""Straight rods of an inextensible net, the flat grid of the paper: tubes on a dome 3.5 m wide."""

import rodshell as rs

target = rs.Cap(radius=2.0, base=1.0)
tube = rs.Rod(rs.Tube(radius=0.006, thickness=0.0015), rs.Material.preset("gfrp"))
form = rs.find_form(target, rs.GridLayout.orthogonal(spacing=0.3), tube, ends="pinned")
gap = form.agreement["pinned"]
print(f"{len(form.footprint.rods)} rods: {gap}")
assert form.popped["pinned"].report.stable
assert gap.max_relative < 0.02
