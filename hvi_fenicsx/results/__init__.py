"""A solution as files: by the contract, written aside and renamed, so that a result is whole or not there."""

from .folder import ResultFolder
from .summary import plain
from .write import write

__all__ = ["ResultFolder", "plain", "write"]
