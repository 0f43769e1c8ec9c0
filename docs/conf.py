"""How the documentation is built."""

from importlib.metadata import version as version_of

project = "opencsp-calib"
author = "The opencsp-calib authors"
release = version = version_of("opencsp-calib")
extensions = ["myst_parser"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = f"opencsp-calib {version}"
exclude_patterns = ["_build"]
