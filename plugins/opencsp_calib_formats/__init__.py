"""Readers and writers of other programs' camera files, one file a format, that need no vendor's library."""

from collections.abc import Iterator

from opencsp_calib import hookimpl
from opencsp_calib.interfaces import CameraFormat


@hookimpl
def camera_formats() -> Iterator[CameraFormat]:
    """All formats of this plugin."""
    from opencsp_calib_formats.alicevision import AliceVision
    from opencsp_calib_formats.aniposelib import Aniposelib
    from opencsp_calib_formats.basalt import Basalt
    from opencsp_calib_formats.boofcv import BoofCV
    from opencsp_calib_formats.bundler import Bundler
    from opencsp_calib_formats.calibio import CalibIo
    from opencsp_calib_formats.caliscope import Caliscope
    from opencsp_calib_formats.camodocal import Camodocal
    from opencsp_calib_formats.halcon import Halcon
    from opencsp_calib_formats.metashape import Metashape
    from opencsp_calib_formats.multical import Multical
    from opencsp_calib_formats.nvm import Nvm
    from opencsp_calib_formats.openmvg import OpenMvg
    from opencsp_calib_formats.opensfm import OpenSfM
    from opencsp_calib_formats.pix4d import Pix4D
    from opencsp_calib_formats.reading import FileFormat
    from opencsp_calib_formats.realitycapture import RealityCapture
    from opencsp_calib_formats.transforms_json import TransformsJson
    from opencsp_calib_formats.tsai import Tsai

    formats: tuple[FileFormat, ...] = (
        AliceVision(),
        Aniposelib(),
        Basalt(),
        BoofCV(),
        Bundler(),
        CalibIo(),
        Caliscope(),
        Camodocal(),
        Halcon(),
        Metashape(),
        Multical(),
        Nvm(),
        OpenMvg(),
        OpenSfM(),
        Pix4D(),
        RealityCapture(),
        TransformsJson(),
        Tsai(),
    )
    yield from formats
