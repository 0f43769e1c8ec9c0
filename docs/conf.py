"""How the documentation is built."""

import sys
from importlib.metadata import version as version_of
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "scripts"))

project = "opencsp-calib"
author = "The opencsp-calib authors"
release = version = version_of("opencsp-calib")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3
napoleon_google_docstring = False
napoleon_use_rtype = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
default_role = "code"
html_theme = "furo"
html_show_copyright = False  # LICENSE says it
html_title = f"opencsp-calib {version}"
exclude_patterns = ["_build", "example_plugin"]


def setup(app: object) -> None:
    """Write the pages that are made from what they are about, so that they are never out of date."""
    import command_page
    import modules_page
    import studies_page

    for name, made in (("commands", command_page), ("modules", modules_page), ("studies", studies_page)):
        (HERE / f"{name}.md").write_text(made.page(), encoding="utf-8")
