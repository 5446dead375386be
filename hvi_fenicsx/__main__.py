"""``python3 -m hvi_fenicsx``: the command line."""

import os
import sys
import warnings

from .cli import main

if __name__ == "__main__":
    # PYTHONWARNINGS=error would end the program at what a library says about itself.
    os.environ.pop("PYTHONWARNINGS", None)
    if any(option.startswith("error") for option in sys.warnoptions):
        warnings.resetwarnings()
        warnings.simplefilter("ignore")
    raise SystemExit(main())
