"""Where a command's results are to go: asked before any work is done."""

from pathlib import Path
from typing import TYPE_CHECKING

from opencsp_calib.errors import InputError

if TYPE_CHECKING:
    from opencsp_calib.images import ImageFile

__all__ = ["check_not_input", "check_targets"]

HTML = (".html", ".htm")


def check_targets(output: Path | None = None, report: Path | None = None) -> None:
    """Before any work: whether its results can be written, and have names that say what they are."""
    from opencsp_calib.atomic import check_writable
    from opencsp_calib.hdf5 import EXTENSIONS

    for path in (output, report):
        if path is not None:
            check_writable(path)
    if output and output.suffix.lower() not in ("", *EXTENSIONS):
        _check_no_other_format(output)
    if report and report.suffix.lower() not in HTML:
        raise InputError(f"{report}: a report is HTML; let its name end in .html")


def _check_no_other_format(output: Path) -> None:
    from opencsp_calib.images import EXTENSIONS as OF_IMAGES
    from opencsp_calib.registry import installed

    ending = output.suffix.lower()
    titles = [form.title for form in installed().camera_formats.values() if ending in form.extensions]
    titles += ["an image"] * (ending in OF_IMAGES) + ["a report"] * (ending in HTML)
    if titles:
        raise InputError(
            f"{output} would be HDF5 under the name of something else ({', '.join(titles)}): let its name end in .h5; "
            "`opencsp-calib convert` then writes other formats"
        )


def check_not_input(files: "tuple[ImageFile, ...]", *targets: Path | None) -> None:
    """No result may take the place of a photograph."""
    photographs = {file.path.resolve() for file in files}
    for target in targets:
        if target is not None and target.resolve() in photographs:
            raise InputError(f"{target} is one of the photographs; give another name for the result")
