"""What a crossing does, and how the rods that meet there share their degrees of freedom."""

from gridshell.joints.joint import Ball, Joint

__all__ = ["Ball", "Joint"]
