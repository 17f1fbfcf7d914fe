"""The 3D viewer of reports, notebooks and live pages: one script, and the scenes that it shows."""

from rodshell.output.viewer.notebook import frame_html, widget_of
from rodshell.output.viewer.scene import Scene, scene_of
from rodshell.output.viewer.script import viewer_script, viewer_style

__all__ = ["Scene", "frame_html", "scene_of", "viewer_script", "viewer_style", "widget_of"]
