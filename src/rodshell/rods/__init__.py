"""Rods: sections and trade sizes, materials, stress over a section; stretch, bend and twist energies [HQK Eq 1]."""
