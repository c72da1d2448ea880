"""The site that `make docs` builds from these pages and from docstrings; it needs no network."""

import re
from pathlib import Path

from docutils.nodes import SkipNode
from latex2mathml.converter import convert
from sphinx.util import logging

README = Path(__file__).resolve().parents[1] / "README.md"
# Links to files of the project: those in docs are pages of the site.
OWN = re.compile(r"\]\((?!\w+:|#)(docs/)?")

project = html_title = "Palpate"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]

# Formulas between dollars or in a fence named math, as GitHub shows them.
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 3

autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

html_theme = "pydata_sphinx_theme"
html_theme_options = {"show_prev_next": False, "navigation_with_keys": False}
html_sidebars = {"**": []}
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_show_copyright = html_show_sourcelink = False
html_math_renderer = "mathml"


def formula(writer, node):
    """Write a formula as MathML, which browsers show without a script."""
    block = node.tagname == "math_block"
    text = convert(node.astext(), display="block" if block else "inline")
    if "\\" in text:
        logging.getLogger(__name__).warning("formula: unknown command: %s", text, location=node)
    writer.body.append(f'<div class="wide">{text}</div>' if block else text)
    raise SkipNode


def with_readme(app, page, content):
    """Begin the first page with README.md, and lead links to it there."""
    content[0] = content[0].replace("](../README.md", "](index.md")
    if page == "index":
        text = README.read_text(encoding="utf-8")
        content[0] = OWN.sub(lambda link: "](" if link[1] else "](../", text) + content[0]


def setup(app):
    """Register both."""
    app.add_html_math_renderer("mathml", (formula, None), (formula, None))
    app.connect("source-read", with_readme)
