"""Pages of jinja2 templates, each in one file that needs nothing from elsewhere."""

import base64
import json
import re
from itertools import count

import cv2
import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup, escape

from palpate.report import TEMPLATES

NUMBER = re.compile(r"(-?\d+(\.\d+)?(e[+-]?\d+)?)?")
TABLE = re.compile(r"<table>.*?</table>", re.DOTALL)
HEAD, CELL = re.compile(r"<th[^>]*>(.*?)</th>"), re.compile(r"<td[^>]*>(.*?)</td>")
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

    Columns of numbers stand right-aligned, their names may break after an underscore. A table that
    is wider than the window scrolls by itself; on a narrow screen each of its rows is a card.
    """
    body = TABLE.sub(_table, PARSER.render(markdown))
    return rendered("page.html.j2", title=title, body=Markup(body))


def title_of(name: str) -> str:
    """An object's name as a heading.

    >>> title_of("foam_ball")
    'Foam ball'
    """
    return name.replace("_", " ").capitalize()


def _table(found: re.Match) -> str:
    """A table with the names of the columns in their cells."""
    heads, cells, at = HEAD.findall(found[0]), CELL.findall(found[0]), count()
    numeric = [all(map(NUMBER.fullmatch, cells[k :: len(heads)])) for k in range(len(heads))]

    def cell(one: re.Match) -> str:
        k = next(at) % len(heads)
        kind = ' class="number"' * numeric[k]
        return f'<td{kind} data-head="{escape(Markup(heads[k]).striptags())}">{one[1]}</td>'

    table = HEAD.sub(lambda head: f"<th>{head[1].replace('_', '_<wbr>')}</th>", found[0])
    table = CELL.sub(cell, table).replace("<table>", '<table class="cards">')
    # Keys scroll what can have the focus.
    return f'<div class="wide" role="region" aria-label="Table" tabindex="0">{table}</div>'


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


LOOK = {"trim_blocks": True, "lstrip_blocks": True, "undefined": StrictUndefined}
ENVIRONMENT = Environment(loader=FileSystemLoader(TEMPLATES), autoescape=True, **LOOK)
ENVIRONMENT.filters |= {"script": _script, "picture": _picture, "title_of": title_of}
# Of Markdown in a line: code and emphasis.
ENVIRONMENT.filters["inline"] = lambda text: Markup(PARSER.renderInline(text))
ENVIRONMENT.filters["single_hyphens"] = lambda text: re.sub("-(?=-)", "- ", text)
