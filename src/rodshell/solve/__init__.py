"""Solvers: linear systems, equilibrium by Newton's method, nested levels. None knows what a drape is."""
