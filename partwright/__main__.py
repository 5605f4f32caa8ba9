"""The command line as a process: `partwright`, or `python -m partwright`."""

import sys

from partwright.cli.interrupts import listen


def main() -> int:
    """Hear Ctrl-C before anything heavy is imported, then run the command line; returns the exit code."""
    listen()
    from partwright.cli.main import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
