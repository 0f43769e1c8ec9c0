"""``opencsp-calib``, and ``python -m opencsp_calib``: whoever stops it while it is loading gets one line, too."""

import sys

__all__ = ["main"]


def main() -> None:
    """Load the command line, and run it."""
    try:
        from opencsp_calib.cli import main as run
    except KeyboardInterrupt:
        sys.exit("error: stopped; nothing was begun")
    run()


if __name__ == "__main__":
    main()
