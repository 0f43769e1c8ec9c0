"""Circle grids, and Open3D's cameras, for opencsp-calib."""

from opencsp_calib import hookimpl


@hookimpl
def boards():
    """`circles:COLUMNSxROWS:SPACING:DIAMETER`."""
    from opencsp_calib_circles.board import CircleGridKind

    yield CircleGridKind()


@hookimpl
def detectors():
    """Finds it."""
    from opencsp_calib_circles.detector import CircleGridDetector

    yield CircleGridDetector()


@hookimpl
def camera_formats():
    """Open3D's PinholeCameraIntrinsic."""
    from opencsp_calib_circles.open3d import Open3D

    yield Open3D()
