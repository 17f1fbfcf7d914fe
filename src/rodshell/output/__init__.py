"""Files made from an archive: drawings, schedules, models, pictures and the report. It reads results, no more."""

from rodshell.output.files import export, save
from rodshell.output.pictures import picture_svg

__all__ = ["export", "picture_svg", "save"]
