"""How many threads the BLAS library below NumPy may use.

Its threads wait for each other at every block of a matrix. Where other threads or another program have one of the
cores, that makes the matrices of a calibration ten to a hundred times slower; on idle cores they hardly gain by them.
"""

from contextlib import AbstractContextManager

from opencsp_calib.process_setting import ProcessSetting, Restore

__all__ = ["blas_on_one_thread"]


def blas_on_one_thread() -> AbstractContextManager[None]:
    """BLAS on one thread, in the whole process; then as before."""
    return _one_thread.changed()


def _change() -> Restore:
    from threadpoolctl import threadpool_limits

    limit = threadpool_limits(limits=1, user_api="blas")
    return lambda: limit.restore_original_limits()


_one_thread = ProcessSetting(_change)
