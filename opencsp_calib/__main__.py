"""``python -m opencsp_calib`` is ``opencsp-calib``."""

from opencsp_calib.cli import main

main()
