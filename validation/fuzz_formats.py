"""Coverage-guided fuzzing of the readers of binary files: only our own errors come out, in bounded time and memory.

Claim
    Whatever the bytes, only our own errors come out of the readers, each input within 5 s and the process within 1 GiB.

Way
    atheris (libFuzzer, guided by coverage of the readers), from the small files of the tests, inputs up to 8 KiB.

Run ``python validation/bench.py fuzz_formats``, a minute of each format; for longer ``python validation/fuzz_formats.py
matlab 600`` (or ``colmap-bin``). It ends with an error at the first exception that is none of ours, an input that takes
longer than 5 s, or 1 GiB of memory; what broke it is left in a file by libFuzzer. It needs atheris, which there is for
Linux: ``pip install --group studies``.
"""

import contextlib
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))


def main() -> None:
    """Fuzz the format named on the command line, for so many seconds."""
    if len(sys.argv) == 1:  # a fuzzer ends its process: each gets one of its own
        for format_name in ("matlab", "colmap-bin"):
            subprocess.run([sys.executable, __file__, format_name, "60"], check=True)
            print(f"{format_name}: 60 s without a failure", flush=True)
        return
    import atheris

    name, seconds = sys.argv[1], int(sys.argv[2])
    with atheris.instrument_imports(include=["opencsp_calib_formats"]):
        from opencsp_calib_formats.colmap import ColmapBinary
        from opencsp_calib_formats.matlab import Matlab
    from format_files_calibration import FILES

    from opencsp_calib.errors import FileFormatError

    format_ = {"matlab": Matlab, "colmap-bin": ColmapBinary}[name]()
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    corpus = folder / "corpus"
    corpus.mkdir()
    for file, content in FILES[name].items():
        (corpus / file).write_bytes(content)
    path = folder / "file.bin"

    def read(data: bytes) -> None:
        path.write_bytes(data)
        format_.recognises(path)
        with contextlib.suppress(FileFormatError):
            for imported in format_.read(path).values():
                assert imported.obstacles or imported.camera or imported.resize

    limits = [f"-max_total_time={seconds}", "-timeout=5", "-rss_limit_mb=1024", "-max_len=8192"]
    atheris.Setup([sys.argv[0], *limits, str(corpus)], read)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
