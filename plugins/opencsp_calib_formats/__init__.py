"""Readers and writers of other programs' camera files, one file a format, that need no vendor's library."""

from collections.abc import Iterator

from opencsp_calib import hookimpl
from opencsp_calib.interfaces import CameraFormat

__all__ = ["camera_formats"]


@hookimpl
def camera_formats() -> Iterator[CameraFormat]:
    """All formats of this plugin."""
    from opencsp_calib_formats.alicevision import AliceVision
    from opencsp_calib_formats.aniposelib import Aniposelib
    from opencsp_calib_formats.basalt import Basalt
    from opencsp_calib_formats.boofcv import BoofCV
    from opencsp_calib_formats.bouguet import Bouguet
    from opencsp_calib_formats.bundler import Bundler
    from opencsp_calib_formats.cahvor import Cahvor
    from opencsp_calib_formats.calibio import CalibIo
    from opencsp_calib_formats.caliscope import Caliscope
    from opencsp_calib_formats.camodocal import Camodocal
    from opencsp_calib_formats.colmap import ColmapBinary, ColmapText
    from opencsp_calib_formats.halcon import Halcon
    from opencsp_calib_formats.kalibr import Kalibr
    from opencsp_calib_formats.matlab import Matlab
    from opencsp_calib_formats.metashape import Metashape
    from opencsp_calib_formats.mrcal_cameramodel import MrcalCameraModel
    from opencsp_calib_formats.multical import Multical
    from opencsp_calib_formats.nvm import Nvm
    from opencsp_calib_formats.opencsp import OpenCSP
    from opencsp_calib_formats.opencv_filestorage import OpenCVFileStorage
    from opencsp_calib_formats.openmvg import OpenMvg
    from opencsp_calib_formats.opensfm import OpenSfM
    from opencsp_calib_formats.pix4d import Pix4D
    from opencsp_calib_formats.reading import FileFormat
    from opencsp_calib_formats.realitycapture import RealityCapture
    from opencsp_calib_formats.ros import RosCameraInfo, RosIni
    from opencsp_calib_formats.transforms_json import TransformsJson
    from opencsp_calib_formats.tsai import Tsai

    formats: tuple[FileFormat, ...] = (
        AliceVision(),
        Aniposelib(),
        Basalt(),
        BoofCV(),
        Bouguet(),
        Bundler(),
        Cahvor(),
        CalibIo(),
        Caliscope(),
        Camodocal(),
        ColmapBinary(),
        ColmapText(),
        Halcon(),
        Kalibr(),
        Matlab(),
        Metashape(),
        MrcalCameraModel(),
        Multical(),
        Nvm(),
        OpenCSP(),
        OpenCVFileStorage(),
        OpenMvg(),
        OpenSfM(),
        Pix4D(),
        RealityCapture(),
        RosCameraInfo(),
        RosIni(),
        TransformsJson(),
        Tsai(),
    )
    yield from formats
