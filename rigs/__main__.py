"""Run the ``rig`` command as ``python -m rigs``."""

import sys

from rigs.cli import main

sys.exit(main())
