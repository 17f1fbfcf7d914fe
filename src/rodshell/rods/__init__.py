"""Material, sections and one elastic rod: stretch, bend and twist energies [HQK Eq 1]."""
