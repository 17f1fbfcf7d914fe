"""Is it safe to build: bending and stress, contact, reactions, deployment, own weight, other shapes."""

from rodshell.checks.check import Checks, check

__all__ = ["Checks", "check"]
