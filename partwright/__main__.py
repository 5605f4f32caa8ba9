"""`python -m partwright`: the command line."""

import sys

from partwright.cli.main import main

sys.exit(main())
