"""A plugin of mypy that changes no check.

Types stay until it ends: the collector of cycles would go through all of them again and again, for a quarter
of the time.
"""

import gc

from mypy.plugin import Plugin

gc.set_threshold(0)


def plugin(version: str) -> type[Plugin]:
    return Plugin
