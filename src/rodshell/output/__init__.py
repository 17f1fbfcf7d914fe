"""What a result looks like on disk and on paper: it reads results and computes no physics.

`write` and `read` keep an `Archive`; drawings, schedules, models and the report are all made from it.
"""

from rodshell.output.archive import Archive, read, write
from rodshell.output.folder import ForeignFileError, open_folder
from rodshell.output.pictures import picture_svg

__all__ = ["Archive", "ForeignFileError", "open_folder", "picture_svg", "read", "write"]
