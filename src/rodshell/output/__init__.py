"""Files made from an archive: drawings, schedules, models, pictures and the report. It reads results, no more."""

from rodshell.output.files import export, save

__all__ = ["export", "save"]
