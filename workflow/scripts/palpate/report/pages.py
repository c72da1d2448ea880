"""Pages of jinja2 templates, each in one file that needs nothing from elsewhere."""

import base64
import json
import re
from pathlib import Path

import cv2
import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup

NUMBER = re.compile(r"<td>(-?\d+(?:\.\d+)?(?:e[+-]?\d+)?)</td>")
HEAD = re.compile(r"<th>(.*?)</th>")
# Keys scroll what can have the focus.
BOX = '<div class="wide" role="region" aria-label="Table" tabindex="0">'
# First bytes of a JPEG, and the quality that asks OpenCV for WebP without loss.
JPEG, LOSSLESS = b"\xff\xd8", 101
PARSER = MarkdownIt("commonmark", {"html": False}).enable("table")


def rendered(template: str, **values: object) -> str:
    """Fill in a template of the folder ``templates``; all values are text, not HTML.

    Raises
    ------
    jinja2.UndefinedError
        If the template asks for a value that is not given.
    """
    return ENVIRONMENT.get_template(template).render(**values)


def page(markdown: str, *, title: str) -> str:
    """Render Markdown with pipe tables as a page; HTML in it is shown as text.

    Numbers stand right-aligned; columns' names may break after an underscore; a table that is wider
    than the window scrolls by itself.
    """
    body = NUMBER.sub(r'<td class="number">\1</td>', PARSER.render(markdown))
    body = HEAD.sub(lambda head: f"<th>{head[1].replace('_', '_<wbr>')}</th>", body)
    body = body.replace("<table>", f"{BOX}<table>").replace("</table>", "</table></div>")
    return rendered("page.html.j2", title=title, body=Markup(body))


def title_of(name: str) -> str:
    """An object's name as a heading.

    >>> title_of("foam_ball")
    'Foam ball'
    """
    return name.replace("_", " ").capitalize()


def _script(data: object) -> Markup:
    """JSON that may stand in a page's script."""
    return Markup(json.dumps(data).replace("<", "\\u003c"))


def _picture(content: bytes) -> str:
    """A picture's address within the page; what is no JPEG as WebP without loss, far smaller."""
    kind = "jpeg"
    if not content.startswith(JPEG):
        pixels = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
        content = cv2.imencode(".webp", pixels, [cv2.IMWRITE_WEBP_QUALITY, LOSSLESS])[1].tobytes()
        kind = "webp"
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _environment() -> Environment:
    loader = FileSystemLoader(Path(__file__).parent / "templates")
    look = {"trim_blocks": True, "lstrip_blocks": True, "undefined": StrictUndefined}
    made = Environment(loader=loader, autoescape=True, **look)
    # Of Markdown in a line: code and emphasis.
    made.filters["inline"] = lambda text: Markup(PARSER.renderInline(text))
    made.filters |= {"script": _script, "picture": _picture, "title_of": title_of}
    return made


ENVIRONMENT = _environment()
