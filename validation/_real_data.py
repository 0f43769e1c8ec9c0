"""Where other people's photographs and files are: beside the checkout, or where OPENCSP_CALIB_DATA says."""

import os
from pathlib import Path

DATA = Path(os.environ.get("OPENCSP_CALIB_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
