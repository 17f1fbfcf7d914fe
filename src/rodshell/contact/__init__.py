"""Gaps to a target turned into node constraints or contact energy."""
