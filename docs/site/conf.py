"""Settings of the documentation site, for Sphinx: `make site` writes it into build/site.

Pages are the Markdown files of docs/, as they are. What Sphinx is not told there: `doors` (which page stands where),
`links` (links to what is no page), `made` (pages that the code writes).
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "Haptic drumstick"
extensions = ["myst_parser", "sphinx.ext.autodoc", "doors", "made", "links"]
exclude_patterns = ["site", "daw/files"]
myst_heading_anchors = 4
myst_url_schemes = ["http", "https", "mailto", "source"]

# Docstrings have `code` between single backticks, and say types, shapes and units in words.
default_role = "code"
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
python_use_unqualified_type_names = True

html_theme = "pydata_sphinx_theme"
html_title = project
html_favicon = "static/favicon.svg"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "header_links_before_dropdown": 6,
    "navigation_depth": 1,  # the buttons that open deeper branches have no name for a screen reader
    "navbar_end": ["theme-switcher"],
    "show_toc_level": 2,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": [],
    "footer_end": [],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
html_context = {"default_mode": "auto"}
