"""The solution methods, one module each, and nested iteration."""

from .method import Method, SolveContext, SolveResult

__all__ = ["Method", "SolveContext", "SolveResult"]
