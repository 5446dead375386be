"""A follower that goes by predictor and corrector whatever the laws are: for paths that are known exactly."""

from __future__ import annotations

from typing import Any
from unittest.mock import patch

from hvi_fenicsx.paths.follower import Follower


class CurvedFollower(Follower):
    """Takes no graph as straight."""

    def __init__(self, *given: Any, **options: Any) -> None:
        rooms = ("point_laws", "vertex_laws")
        first, second = (patch(f"hvi_fenicsx.paths.{room}.is_straight", lambda problem: False) for room in rooms)
        with first, second:
            super().__init__(*given, **options)
