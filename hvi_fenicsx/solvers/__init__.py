"""The solution methods, one module each, and nested iteration."""

from .context import SolveContext
from .method import Method
from .result import SolveResult

__all__ = ["Method", "SolveContext", "SolveResult"]
