"""Tables and lists in Markdown as pages that a browser shows by themselves."""

import base64
import re
from collections.abc import Mapping, Sequence
from html import escape

from markdown_it import MarkdownIt

from palpate.markdown import rows_of

STYLE = """
:root { color-scheme: light dark; --ink: #1a1a1a; --paper: #fff; --soft: #f4f4f4; --line: #ddd;
  --quiet: #555; --accent: #0b5c93; }
@media (prefers-color-scheme: dark) { :root { --ink: #e8e8e8; --paper: #14171a; --soft: #22272c;
  --line: #3c444c; --quiet: #b4bac0; --accent: #7cc4f2; } }
body { font: 14px/1.45 "DejaVu Sans", Verdana, sans-serif; color: var(--ink);
  background: var(--paper); margin: 1.2em; }
h1 { font-size: 1.15em; margin: 0 0 .6em; }
h2 { font-size: 1em; margin: 1.4em 0 .4em; }
p, ul { max-width: 60em; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th { border-bottom: 2px solid var(--ink); text-align: left; vertical-align: bottom; }
th, td { padding: .25em .8em .25em 0; }
td { border-bottom: 1px solid var(--line); white-space: nowrap; }
td.number { text-align: right; }
img { max-width: min(100%, 62em); height: auto; }
pre { background: var(--soft); padding: .8em; overflow-x: auto; }
:focus-visible { outline: 3px solid var(--accent); outline-offset: 2px; }
"""
NUMBER = re.compile(r"<td>(-?\d+(?:\.\d+)?(?:e[+-]?\d+)?)</td>")
HEAD = re.compile(r"<th>(.*?)</th>")
# Keys scroll what can have the focus.
BOX = '<div class="wide" role="region" aria-label="Table" tabindex="0">'


def page(markdown: str, *, title: str) -> str:
    """Render Markdown as a page without scripts and without anything from elsewhere.

    HTML in the text with pipe tables is shown as text.
    """
    return document(rendered(markdown), title=title)


def rendered(markdown: str) -> str:
    """Render Markdown with pipe tables as a part of a page; HTML in it is shown as text.

    Numbers stand right-aligned; columns' names may break after an underscore; a table that is wider
    than the window scrolls by itself.
    """
    parser = MarkdownIt("commonmark", {"html": False}).enable("table")
    body = NUMBER.sub(r'<td class="number">\1</td>', parser.render(markdown))
    body = HEAD.sub(lambda head: f"<th>{head[1].replace('_', '_<wbr>')}</th>", body)
    return body.replace("<table>", f"{BOX}<table>").replace("</table>", "</table></div>")


def table(rows: Sequence[Mapping[str, str]]) -> list[str]:
    """Lines of a pipe table of rows with the same keys."""
    head = list(rows[0])
    return list(rows_of(head, ([row[key] for key in head] for row in rows)))


def figure(content: bytes, kind: str, caption: str) -> str:
    """A picture within the page, with its caption; its text is what stands before a colon."""
    encoded = base64.b64encode(content).decode("ascii")
    image = f'<img alt="{caption.partition(":")[0]}" src="data:{kind};base64,{encoded}">'
    return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"


def document(body: str, *, title: str, style: str = "", behaviour: str = "") -> str:
    """Put HTML into a page of the project's look, with more style and a script at its end."""
    script = f"<script>\n{behaviour}</script>\n" if behaviour else ""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}{style}</style>\n</head>\n"
        f"<body>\n{body}{script}</body>\n</html>\n"
    )
