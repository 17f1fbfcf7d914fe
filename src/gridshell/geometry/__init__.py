"""Pure geometry: vectors, and frames carried along curves."""

from gridshell.geometry.frames import adapted, directors_along, parallel_transport, signed_angle

__all__ = ["adapted", "directors_along", "parallel_transport", "signed_angle"]
