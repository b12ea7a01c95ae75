"""Sphinx settings of the site; build.py beside this file lays out what it reads."""
import os
import re
from pathlib import Path

build = Path(os.environ["PORTHOS_DOCS_BUILD"])

project = "Porthos"
author = "the Porthos authors"
changelog = (Path(__file__).parent / "CHANGELOG.md").read_text()
version = release = re.search(r"^## (\d+\.\d+\.\d+)", changelog, re.M)[1]

extensions = ["myst_parser", "breathe", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
myst_update_mathjax = False
mathjax_path = "mathjax/MathJax.js?config=TeX-AMS_SVG"  # Debian's copy, put into the site: no network
mathjax2_config = {
    "tex2jax": {"inlineMath": [["\\(", "\\)"]], "displayMath": [["\\[", "\\]"]], "ignoreClass": "document", "processClass": "math"},
    "SVG": {"scale": 90},
    "messageStyle": "none",
}
highlight_language = "none"
suppress_warnings = ["myst.header", "cpp.duplicate_declaration", "duplicate_declaration.cpp"]

html_theme = "porthos"
html_theme_path = ["themes"]
html_title = f"Porthos {release}"
html_show_sourcelink = False
html_static_path = ["static"]

breathe_projects = {"porthos": str(build / "doxygen/xml")}
breathe_default_project = "porthos"
