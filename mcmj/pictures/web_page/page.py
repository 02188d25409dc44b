"""The page: the template with the scene, MuJoCo and the scripts put in; no other file is needed."""

import json
import re
from html import escape
from importlib.resources import files

from mcmj.pictures.web_page.package import VERSION, Package
from mcmj.pictures.web_page.scene import Scene
from mcmj.utils.files import plain

SCRIPTS = ("physics.js", "drawing.js", "controls.js", "main.js")
EXPORT = "export default loadMujoco;"  # of MuJoCo's module, which becomes a part of the page's
_HERE = files(__package__)


def page(scene: Scene, package: Package) -> str:
    """The page as HTML.

    Args:
        scene: what it shows.
        package: MuJoCo for browsers.
    """
    runs = f"MuJoCo {VERSION} runs in this page, under {scene.options.integrator}."
    parts = {
        "title": escape(scene.title),
        "style": _part("style.css"),
        "note": escape(f"{runs} {scene.note}".strip()),
        "scene": json.dumps(plain(scene.plain), allow_nan=False).replace("<", "\\u003c"),
        "wasm": package.wasm,
        "licences": package.licences,
        "javascript": _scripts(package.javascript),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda place: parts[place[1]], _part("template.html"))


def _part(name: str) -> str:
    return _HERE.joinpath(name).read_text(encoding="utf-8")


def _scripts(loader: str) -> str:
    """MuJoCo's loader and the page's own scripts as one module: files opened by a double click
    may import no others."""
    assert EXPORT in loader
    text = "\n".join([loader.replace(EXPORT, ""), *map(_part, SCRIPTS)])
    assert "</script" not in text.lower()  # would end the element
    return text
