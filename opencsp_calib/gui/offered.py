"""What plugins offer that can run here: asked for once the first page is there, because some have to try first."""

from dataclasses import dataclass

from opencsp_calib.registry import installed

__all__ = ["Offered"]

OURS = "opencsp"
"""The format that is offered as HDF5, with the calibration in it."""


@dataclass(frozen=True)
class Offered:
    """Choices by name, with what people call them.

    Parameters
    ----------
    solvers, detectors, formats : dict of str to str
        Formats are those of other programs that can be written.
    """

    solvers: dict[str, str]
    detectors: dict[str, str]
    formats: dict[str, str]

    @classmethod
    def here(cls) -> "Offered":
        """As installed; takes a second."""
        known = installed()
        formats = sorted(known.camera_formats.items())
        return cls(
            {name: name for name, solver in sorted(known.solvers.items()) if solver.missing() is None},
            {name: name for name, detector in sorted(known.detectors.items()) if detector.missing() is None},
            {name: f.title for name, f in formats if f.writes and f.missing() is None and name != OURS},
        )
