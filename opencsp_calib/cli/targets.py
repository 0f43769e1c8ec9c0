"""Where a command's results are to go: asked before any work is done."""

from collections.abc import Iterable
from pathlib import Path

from opencsp_calib.errors import InputError

__all__ = ["check_not_input", "check_targets"]

HTML = (".html", ".htm")


def check_targets(output: Path | None = None, report: Path | None = None) -> None:
    """Before any work: whether its results can be written, and have names that say what they are."""
    from opencsp_calib.atomic import check_writable
    from opencsp_calib.hdf5_reading import EXTENSIONS

    for path in (output, report):
        if path is not None:
            check_writable(path)
    if output and output.suffix.lower() not in ("", *EXTENSIONS):
        raise InputError(_named_otherwise(output))
    if report and report.suffix.lower() not in HTML:
        raise InputError(f"{report}: a report is HTML; let its name end in .html")


def _named_otherwise(output: Path) -> str:
    """What is wrong with an HDF5 file of that name."""
    from opencsp_calib.images import EXTENSIONS as OF_IMAGES
    from opencsp_calib.registry import installed

    ending = output.suffix.lower()
    titles = [form.title for form in installed().camera_formats.values() if ending in form.extensions]
    titles += ["an image"] * (ending in OF_IMAGES) + ["a report"] * (ending in HTML)
    named = f"the name of something else ({', '.join(titles)})" if titles else "another name"
    hint = "; `opencsp-calib convert` then writes a camera in other formats" if titles else ""
    return f"{output} would be HDF5 under {named}: let its name end in .h5{hint}"


def check_not_input(inputs: Iterable[Path], *targets: Path | None) -> None:
    """No result may take the place of what it is made from."""
    read = {path.resolve() for path in inputs}
    for target in targets:
        if target is not None and target.resolve() in read:
            raise InputError(f"{target} is itself what is read; give another name for the result")
