"""Small files of other programs, made up here, one a format: what the readers are tried with and what is mutated."""

from collections.abc import Mapping

import format_files_calibration
import format_files_photogrammetry
import format_files_robotics

__all__ = ["FILES"]

FILES: Mapping[str, Mapping[str, bytes]] = {
    **format_files_photogrammetry.FILES,
    **format_files_robotics.FILES,
    **format_files_calibration.FILES,
}
"""By format, then by file name."""
