"""A process that draws beside the ranks takes no time from them."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

_PRINTED = """
import json, os
from hvi_fenicsx.runtime import processes
processes.stand_back()
print(json.dumps([os.nice(0), sorted(os.sched_getaffinity(0))]))
"""


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system binds no process to a processor")
def test_what_stands_back_comes_after_the_ranks_and_is_not_bound_to_their_processor() -> None:
    """As the child of a rank that mpirun has bound to one processor."""
    every = os.sched_getaffinity(0)

    def bind() -> None:
        os.sched_setaffinity(0, {min(every)})

    words = [sys.executable, "-c", _PRINTED]
    done = subprocess.run(words, capture_output=True, text=True, check=True, preexec_fn=bind)
    niceness, processors = json.loads(done.stdout)
    assert niceness >= min(os.nice(0) + 10, 19)
    assert set(processors) >= every
