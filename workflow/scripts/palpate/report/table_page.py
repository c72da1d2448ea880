"""Tables and lists in Markdown as pages that a browser shows by themselves."""

import re
from html import escape

from markdown_it import MarkdownIt

STYLE = """
body { font: 14px/1.45 "DejaVu Sans", Verdana, sans-serif; color: #1a1a1a; background: #fff;
  margin: 1.2em; }
h1 { font-size: 1.15em; margin: 0 0 .6em; }
h2 { font-size: 1em; margin: 1.4em 0 .4em; }
p, ul { max-width: 60em; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th { position: sticky; top: 0; background: #fff; border-bottom: 2px solid #1a1a1a;
  text-align: left; vertical-align: bottom; }
th, td { padding: .25em .8em .25em 0; }
td { border-bottom: 1px solid #ddd; white-space: nowrap; }
td.number { text-align: right; }
img { max-width: min(100%, 62em); height: auto; }
pre { background: #f4f4f4; padding: .8em; overflow-x: auto; }
"""
NUMBER = re.compile(r"<td>(-?\d+(?:\.\d+)?(?:e[+-]?\d+)?)</td>")
HEAD = re.compile(r"<th>(.*?)</th>")


def page(markdown: str, *, title: str) -> str:
    """Render Markdown as a page without scripts and without anything from elsewhere.

    Parameters
    ----------
    markdown : str
        Text with pipe tables; HTML in it is shown as text.
    title : str

    Returns
    -------
    str
        HTML. Numbers stand right-aligned; columns' names may break after an underscore.
    """
    parser = MarkdownIt("commonmark", {"html": False}).enable("table")
    body = NUMBER.sub(r'<td class="number">\1</td>', parser.render(markdown))
    body = HEAD.sub(lambda head: f"<th>{head[1].replace('_', '_<wbr>')}</th>", body)
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n"
        f"<body>\n{body}</body>\n</html>\n"
    )
