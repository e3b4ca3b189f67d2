"""``python -m epicycle``: the command line."""

from epicycle.runner.interface.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
