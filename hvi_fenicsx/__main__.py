"""``python3 -m hvi_fenicsx``: the command line."""

from .cli import main

if __name__ == "__main__":
    raise SystemExit(main())
