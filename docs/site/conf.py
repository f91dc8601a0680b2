"""Sphinx's settings. What it reads is made by build_site.py: do not run sphinx-build by itself."""

from docutils import nodes
from latex2mathml.converter import convert

import moit

project = "moit"
author = "The moit authors"
copyright = "the moit authors, BSD-3-Clause"
version = release = moit.__version__

extensions = ["myst_nb", "sphinx_design"]
html_theme = "pydata_sphinx_theme"
html_title = "moit"
html_static_path = ["_static"]
html_css_files = ["moit.css"]
html_theme_options = {
    "logo": {"text": "moit"},
    "show_toc_level": 2,
    "navbar_end": ["theme-switcher"],
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
html_show_sourcelink = False
html_sidebars = {"index": [], "which_one": []}

exclude_patterns = ["_static"]
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
myst_url_schemes = ("http", "https")
nb_execution_mode = "off"  # notebooks have their outputs; tests/test_notebooks.py holds them to it
nb_merge_streams = True
nitpicky = True
# Reports that moit writes begin at the third level, as they stand below others elsewhere.
suppress_warnings = ["mystnb.unknown_mime_type", "config.cache", "myst.header"]
html_math_renderer = "mathml"  # which browsers draw by themselves, without a network
python_use_unqualified_type_names = True
add_module_names = False
toc_object_entries = False


def _inline(writer, node):
    writer.body.append(convert(node.astext(), display="inline"))
    raise nodes.SkipNode


def _block(writer, node):
    writer.body.append(f'<div class="formula">{convert(node.astext(), display="block")}</div>')
    raise nodes.SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
