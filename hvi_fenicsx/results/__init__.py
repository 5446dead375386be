"""A solution as files: by the contract, written aside and moved in, so that a result is whole or not there."""

from .output_folder import ResultFolder, resolved
from .summary import plain

__all__ = ["ResultFolder", "plain", "resolved"]
