"""What a result looks like on disk and on paper: it reads results and computes no physics.

`write` and `read` keep an `Archive`; drawings, schedules, models and the report are all made from it.
"""

from gridshell.output.archive import Archive, read, write
from gridshell.output.folder import check_folder
from gridshell.output.pictures import picture_svg

__all__ = ["Archive", "check_folder", "picture_svg", "read", "write"]
