"""The `stickslip` command, also as ``python -m stickslip``."""

import sys

from stickslip._packages import require_own_packages


def main() -> int:
    """Run the command of the command line; returns the exit code."""
    try:
        require_own_packages()
    except ImportError as error:
        sys.stderr.write(f"stickslip: {error}\n")
        return 2
    from study.cli import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
