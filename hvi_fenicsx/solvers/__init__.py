"""The solution methods, one module each, and nested iteration."""

from .context import SolveContext
from .method import Method, SolveResult

__all__ = ["Method", "SolveContext", "SolveResult"]
