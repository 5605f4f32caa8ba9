"""The command line as a process: `partwright`, or `python -m partwright`."""

import gc
import os
import sys

_SELDOM = (100_000, 50, 50)
"""How often Python's collector looks for cycles: hardly any are made, and each look goes through all that the
imports have made, which was a thirtieth of a fit's work."""


def main() -> int:
    """Hear Ctrl-C before anything else is imported, then run the command line; returns the exit code.

    What comes before that is Python's own start, some hundredths of a second: a Ctrl-C there ends the
    process as it ends any that Python runs, with its traceback, and nothing has been done yet.
    """
    try:
        from partwright.cli.interrupts import listen

        listen()
    except KeyboardInterrupt:
        os._exit(130)
    gc.set_threshold(*_SELDOM)
    from partwright.cli.main import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
