"""``python -m study`` is the `stickslip` command."""

import sys

from study.cli import main

sys.exit(main())
