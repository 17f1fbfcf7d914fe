"""Pure geometry: vectors, and frames carried along curves."""

from rodshell.geometry.frames import adapted, directors_along, parallel_transport, signed_angle

__all__ = ["adapted", "directors_along", "parallel_transport", "signed_angle"]
