"""``python3 -m hvi_fenicsx``: the command line."""

import os
import signal
import sys
import warnings

if __name__ == "__main__" and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # until the command catches it: Python would end by a traceback

from .commands.cli import main

if __name__ == "__main__":
    # PYTHONWARNINGS=error would end the program at what a library says about itself.
    os.environ.pop("PYTHONWARNINGS", None)
    if any(option.startswith("error") for option in sys.warnoptions):
        warnings.resetwarnings()
        warnings.simplefilter("ignore")
    raise SystemExit(main())
