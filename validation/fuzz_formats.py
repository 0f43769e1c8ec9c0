"""Coverage-guided fuzzing of the readers of binary files: only our own errors come out, in bounded time and memory.

Run ``python validation/fuzz_formats.py matlab 60`` (or ``colmap-bin``): 60 seconds with atheris, which has to be
installed. It starts from the small files of the tests, ends with an error at the first exception that is none of ours,
an input that takes longer than 5 s, or 1 GiB of memory; what broke it is left in a file by libFuzzer.
"""

import contextlib
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))


def main() -> None:
    """Fuzz the format named on the command line, for so many seconds."""
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
