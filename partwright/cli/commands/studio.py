"""What `partwright studio` does."""

from __future__ import annotations

import argparse
import threading
import webbrowser

from partwright.cli.terminal import note, say
from partwright.errors import MissingDependencyError, SettingError


def run(arguments: argparse.Namespace) -> int:
    try:
        from partwright.studio.server import LOOPBACK, serve
    except ModuleNotFoundError as error:
        if error.name is None or error.name.startswith("partwright"):
            raise
        raise MissingDependencyError(
            f"the studio needs the package {error.name}; install it with: pip install 'partwright[studio]'"
        ) from error
    if arguments.port is not None and not 0 <= arguments.port < 65536:
        raise SettingError(f"--port {arguments.port}: expected a number from 0 to 65535")
    if arguments.host not in (LOOPBACK, "localhost", "::1"):
        note(
            f"warning: listening on {arguments.host}: everyone who reaches this machine there and has the "
            "address below can see, edit and export the assembly, and load files into the page; "
            "it is not encrypted"
        )

    def ready(url: str) -> None:
        say(f"the studio is at {url}")
        say("Ctrl-C ends it; every edit is kept")
        if not arguments.no_browser:
            threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()

    serve(arguments.file, arguments.shape, host=arguments.host, port=arguments.port, ready=ready)
    return 0
