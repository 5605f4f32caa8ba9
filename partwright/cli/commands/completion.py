"""What `partwright completion` does."""

from __future__ import annotations

import argparse

import argcomplete


def run(arguments: argparse.Namespace) -> int:
    print(argcomplete.shellcode(["partwright"], shell=arguments.shell))
    return 0
