"""The viewer in notebooks: a frame of its own in the output of a cell, or a widget that Python can talk to.

The frame holds script and scene, compressed, so that it needs no network, no kernel and no extension, and is still
there when the notebook is opened again. The widget (`pip install "rodshell[notebook]"`) passes what is clicked to
Python.
"""

import base64
import gzip
from functools import cache
from html import escape
from typing import TYPE_CHECKING, Any

from rodshell.errors import InputError
from rodshell.output.viewer.scene import Scene
from rodshell.output.viewer.script import viewer_script, viewer_style

if TYPE_CHECKING:
    from anywidget import AnyWidget

HEIGHT = 560  # px, of a frame

_LOAD = """
const unpacked = async text => {
  const bytes = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
};
const viewerModule = async text => {
  const script = new Blob([await (await unpacked(text)).text()], { type: "text/javascript" });
  return import(URL.createObjectURL(script));
};
"""
_PAGE = """<!doctype html><meta charset="utf-8">
<style>{style} body {{ margin: 0 }} .rs-viewer {{ --rs-height: 25rem }}</style>
<div id="view"></div><script type="module">{load}
const {{ createViewer }} = await viewerModule("{script}");
createViewer(document.getElementById("view")).show(await (await unpacked("{scene}")).arrayBuffer());
</script>"""
_WIDGET = """{load}
const script = "{script}";
export default {{
  async render({{ model, el }}) {{
    const {{ createViewer }} = await viewerModule(script);
    const host = document.createElement("div");
    el.append(host);
    const viewer = createViewer(host);
    const shown = () => viewer.show(model.get("scene"));
    viewer.on("pick", found => {{ model.set("picked", found ? found.id : ""); model.save_changes(); }});
    model.on("change:scene", shown);
    shown();
    return () => viewer.dispose();
  }},
}};
"""


def frame_html(scene: Scene) -> str:
    """The viewer with a scene as one HTML element."""
    packed = _packed(scene.content())
    page = _PAGE.format(style=viewer_style(), load=_LOAD, script=_packed_script(), scene=packed)
    attributes = f'style="width: 100%; height: {HEIGHT}px; border: 0" title="The gridshell in 3D"'
    return f'<iframe {attributes} srcdoc="{escape(page)}"></iframe>'


def widget_of(scene: Scene) -> "AnyWidget":
    """The viewer with a scene as a widget, whose `picked` is the id of the rod or joint that was clicked last.

    Raises:
        InputError: anywidget is not installed.
    """
    try:
        import anywidget
        import traitlets
    except ImportError:
        raise InputError('a widget needs anywidget: pip install "rodshell[notebook]"') from None

    traits: dict[str, Any] = {
        "_esm": _WIDGET.format(load=_LOAD, script=_packed_script()),
        "_css": viewer_style(),
        "scene": traitlets.Bytes().tag(sync=True),
        "picked": traitlets.Unicode("").tag(sync=True),
    }
    kind = type("ShellView", (anywidget.AnyWidget,), traits)
    widget: AnyWidget = kind(scene=scene.content())
    return widget


@cache
def _packed_script() -> str:
    return _packed(viewer_script().encode())


def _packed(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, mtime=0)).decode()
