"""The commands around calibrating: board, demo, plugins, and the versions."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from opencsp_calib.cli import arguments as args
from opencsp_calib.cli.console import detection_progress, print_json, progress_bar, say, say_judgement, say_table

if TYPE_CHECKING:
    from opencsp_calib.calibration import Calibration
    from opencsp_calib.camera import Camera
    from opencsp_calib.comparison import Difference

KINDS = ("boards", "detectors", "solvers", "camera_formats", "image_sources")


def board(
    spec: Annotated[str, typer.Argument(metavar="SPEC", help="Such as checkerboard:18x23:50mm.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="board.svg, board.pdf or board.png.")],
) -> None:
    """Draw a board to print at true size."""
    from opencsp_calib.drawing import write_board
    from opencsp_calib.pipeline import board_from
    from opencsp_calib.registry import installed

    target = board_from(spec)
    write_board(target, installed().board_kind(target.kind).draw(target), output)
    say(f"board saved: {output}; print it at 100 %, and measure its scale bar")


def plugins(json: args.Json = False) -> None:
    """List what the installed plugins provide, and what is missing where one cannot run."""
    from opencsp_calib.registry import installed

    registry = installed()
    rows, listed = [], []
    for kind in KINDS:
        for name, provided in sorted(getattr(registry, kind).items()):
            what = kind.rstrip("s").replace("_", " ")
            origin = registry.origins[kind, name]
            rows.append((what, name, origin, provided.missing() or "ready"))
            listed.append({"kind": what, "name": name, "plugin": origin, "missing": provided.missing()})
    say_table(("kind", "name", "plugin", "state"), rows)
    if json:
        print_json({"plugins": listed})


def demo(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where to put it.")] = Path("demo"),
    views: Annotated[int, typer.Option(min=3, help="How many photographs.")] = 50,
    jobs: args.Jobs = None,
    json: args.Json = False,
) -> None:
    """Render photographs of a board as the procedure asks for, calibrate, and say how far that is from the truth."""
    import time

    from opencsp_calib import pipeline
    from opencsp_calib.comparison import compare
    from opencsp_calib.demo import make_demo
    from opencsp_calib.detecting import usable_cores
    from opencsp_calib.hdf5_calibration import save_calibration
    from opencsp_calib.report import write_report

    started = time.perf_counter()
    with progress_bar("Rendering photographs") as advance:
        world = make_demo(folder, views, jobs=jobs or usable_cores(), progress=advance)
    rendered = time.perf_counter()
    with detection_progress() as progress:
        calibration = pipeline.calibrate(world.images, world.board, name="demo", jobs=jobs, progress=progress)
    solved = time.perf_counter()
    save_calibration(calibration, folder / "camera.h5")
    write_report(calibration, folder / "report.html")
    difference = compare(calibration.camera, world.camera)
    _say_demo(calibration, world.camera, difference)
    say_judgement(calibration)
    say(f"rendered in {rendered - started:.1f} s, calibrated in {solved - rendered:.1f} s")
    say(f"camera saved: {folder / 'camera.h5'}")
    say(f"report saved: {folder / 'report.html'}; open it in a browser")
    if json:
        from opencsp_calib.summary import camera_as_json

        print_json(
            {
                "truth": camera_as_json(world.camera),
                "camera": camera_as_json(calibration.camera, calibration.sigma),
                "rms_px": calibration.rms_px,
                "difference": {"rms_px": difference.rms_px, "worst_px": difference.worst_px},
                "seconds": {"render": rendered - started, "calibrate": solved - rendered},
                "output": str(folder / "camera.h5"),
            }
        )


COMMANDS = (board, demo, plugins)


def print_versions() -> None:
    """Ours, Python's, and those of plugins and engines, for bug reports."""
    import platform
    from importlib.metadata import entry_points, version

    from opencsp_calib.hookspecs import GROUP
    from opencsp_calib.registry import installed

    typer.echo(f"opencsp-calib {version('opencsp-calib')}, Python {platform.python_version()}, {platform.platform()}")
    typer.echo(", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "h5py")))
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        origin = f"{point.dist.name} {point.dist.version}" if point.dist else point.value
        typer.echo(f"plugin {point.name}: {origin}")
    for name, solver in sorted(installed().solvers.items()):
        typer.echo(f"solver {name}: {solver.missing() or solver.version()}")


def _say_demo(calibration: "Calibration", truth: "Camera", difference: "Difference") -> None:
    """How far the result is from the truth."""
    import numpy as np

    names, errors = truth.lens.parameter_names, calibration.camera.params - truth.params
    rows = [
        (name, f"{true:.6g}", f"{found:.6g}", f"{error:+.2g}", f"{sigma:.2g}")
        for name, true, found, error, sigma in zip(
            names, truth.params, calibration.camera.params, errors, np.asarray(calibration.sigma), strict=True
        )
    ]
    say_table(("parameter", "truth", "found", "error", "±1 sigma"), rows)
    say(f"rms {calibration.rms_px:.4f} px; over the image the camera is {difference.rms_px:.4f} px rms from the truth,")
    say(f"{difference.worst_px:.4f} px at worst (frames aligned)")
