"""The solver ``mrcal`` against truth, and what becomes of an mrcal that is absent, slow, killed, or talks nonsense."""

import os
import shlex
import stat
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from opencsp_calib_mrcal import process
from opencsp_calib_mrcal.solver import MrcalSolver
from solver_worlds import SEED_BOARD, sandia, seed_world, worst_px

from opencsp_calib.convergence import remaining_sigmas
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.options import SolveOptions
from opencsp_calib.pipeline import solve
from opencsp_calib.synthetic import bowed

needs_mrcal = pytest.mark.skipif(process.missing_mrcal() is not None, reason=str(process.missing_mrcal()))


def solved(observations, model="opencv4", **options):
    return MrcalSolver().solve(observations, model, SolveOptions(**options))


@needs_mrcal
def test_exact_pixels_give_the_camera():
    camera, _, observations = seed_world(50)
    assert worst_px(camera, solved(observations).camera) < 1e-6


@needs_mrcal
def test_exact_pixels_of_a_measured_board_give_the_camera():
    shift = np.random.default_rng(4).normal(0.0, 3e-4, SEED_BOARD.points.shape)
    camera, _, observations = seed_world(20, board=SEED_BOARD.with_points(SEED_BOARD.points + shift))
    assert worst_px(camera, solved(observations).camera) < 1e-6


@needs_mrcal
def test_the_board_as_grid_and_as_points_have_one_minimum():
    _, _, observations = seed_world(20, noise_px=0.2)
    nudged = observations.with_board(SEED_BOARD.with_points(SEED_BOARD.points + 1e-9))
    # of a model that is led to the minimum itself: mrcal alone stops up to 1e-6 px from it, after a step more or less
    as_grid, as_points = (solved(seen, "opencv8").camera for seen in (observations, nudged))
    assert worst_px(as_grid, as_points) < 1e-6


@needs_mrcal
@pytest.mark.parametrize("model", ["opencv4", "opencv8"])
def test_there_is_no_regularisation(data_dir, model):
    """At the least sum of squares alone, with mrcal's weak priors, the gradient of the squares would not vanish."""
    observations, _ = sandia(data_dir)
    assert remaining_sigmas(solved(observations, model)) < 1e-3


@needs_mrcal
def test_the_rms_is_of_vectors(data_dir):
    """Mrcal's own is per axis; OpenCSP's stored 0.19094 px of the same corners is not."""
    observations, expected = sandia(data_dir)
    assert solved(observations).rms_px == pytest.approx(expected["calibration_error"], abs=1e-6)


@needs_mrcal
def test_a_bow_is_found_as_warp():
    camera, _, observations = seed_world(20, noise_px=0.02, board=bowed(SEED_BOARD, 1.5e-3), given=SEED_BOARD)
    flat, warped = solved(observations), solved(observations, board_shape="warp")
    assert worst_px(camera, flat.camera) > 1.0
    assert worst_px(camera, warped.camera) < 0.05
    assert np.ptp(warped.board.points[:, 2]) == pytest.approx(1.5e-3, rel=0.01)


@needs_mrcal
def test_what_mrcal_knows_of_even_boards_only_is_refused_of_others():
    _, _, observations = seed_world(5)
    measured = observations.with_board(SEED_BOARD.with_points(SEED_BOARD.points * 1.001))
    with pytest.raises(InputError, match="outliers only on an even board"):
        solved(measured, robust=True)
    with pytest.raises(InputError, match="warp only on an even board"):
        solved(measured, board_shape="warp")


@needs_mrcal
def test_unless_told_otherwise_it_takes_any_board_and_any_corners():
    """Weights and outliers are for `bundle` by default: mrcal would refuse this board and these corners with them."""
    _, _, observations = seed_world(5)
    measured = observations.with_board(SEED_BOARD.with_points(SEED_BOARD.points * 1.001))
    assert measured.detections[0].covariance is None
    options = solve(measured, solver="mrcal").options
    assert (options.weights, options.robust) == ("equal", False)


@pytest.fixture
def python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Makes a program take the place of the Python that has mrcal."""

    def make(script: str) -> None:
        program, code = tmp_path / "python", tmp_path / "code.py"
        program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {shlex.quote(str(code))} "$@"\n')
        code.write_text(
            "import os, sys, time\nif '--version' in sys.argv:\n    print('0.0')\n"
            f"    sys.exit()\nproblem, solution = sys.argv[2:]\n{script}\n"
        )
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setenv(process.VARIABLE, str(program))
        process._probed.cache_clear()

    yield make
    process._probed.cache_clear()


def failure(timeout_s=None) -> str:
    _, _, observations = seed_world(3)
    with pytest.raises(CalibrationFailedError) as said:
        MrcalSolver(timeout_s).solve(observations, "opencv4", SolveOptions())
    assert "\n" not in str(said.value)
    return str(said.value)


def test_a_crash_is_one_line(python):
    python("print('Traceback\\n  of many lines', file=sys.stderr)\nsys.exit('RuntimeError: the matrix is singular')")
    assert failure() == "mrcal failed: RuntimeError: the matrix is singular"


def test_being_killed_is_one_line(python):
    python("os.kill(os.getpid(), 9)")
    assert failure() == "mrcal failed: it was ended by signal 9"


def test_a_hang_ends_even_with_a_child_that_holds_its_streams(python):
    python("import subprocess\nsubprocess.Popen(['sleep', '90'])\ntime.sleep(90)")
    start = time.monotonic()
    assert "did not end within 1 s" in failure(timeout_s=1.0)
    assert time.monotonic() - start < 60


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("", "cannot be read"),
        ("open(solution, 'wb').write(b'garbage')", "cannot be read"),
        ("open(solution, 'wb').write(open(problem, 'rb').read()[:300])", "cannot be read"),
        ("import numpy as np\nnp.savez(solution, poses=np.array([{}]))", "cannot be read"),
        ("import numpy as np\nnp.savez(solution, poses=np.zeros((3, 6)))", "'intrinsics'"),
        ("import numpy as np\nnp.savez(solution, poses=np.zeros((2, 6)))", "mrcal's poses has shape"),
        ("import numpy as np\nnp.savez(solution, poses=np.full((3, 6), np.nan), intrinsics=np.ones(8))", "no solution"),
        ("import numpy as np\nnp.savez(solution, poses=np.zeros((3, 6)), intrinsics=np.ones(5))", "intrinsics"),
    ],
)
def test_nonsense_is_one_line(python, script, said):
    python(script)
    assert said in failure()


def test_absence_says_what_to_install(python, monkeypatch):
    monkeypatch.setenv(process.VARIABLE, "/no/such/python")
    assert "/no/such/python" in str(MrcalSolver().missing())
    assert "mrcal cannot run" in failure()
    monkeypatch.delenv(process.VARIABLE)
    monkeypatch.setattr(process, "DEBIAN", "/no/such/python")
    assert "apt install python3-mrcal" in str(MrcalSolver().missing())


@needs_mrcal
def test_debians_python_sees_no_packages_of_another(monkeypatch, tmp_path):
    (tmp_path / "numpy.py").write_text("raise ImportError('not this one')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.delenv(process.VARIABLE, raising=False)
    if os.path.samefile(process.DEBIAN, sys.executable):
        pytest.skip("this is Debian's Python itself")
    _, _, observations = seed_world(3)
    assert solved(observations).rms_px < 1e-3
