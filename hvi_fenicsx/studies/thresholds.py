"""The numbers that tune studies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """The numbers that tune a study.

    Attributes:
        largest_point: unknowns of the finest point that the default plan chooses, by dimension.
        largest_reference: unknowns of the reference, by dimension.
        coarser_meshes: of the default plan, below the scene's own; each has half the cells each way.
        finer_meshes: of the default plan, above the scene's own.
        widths: of the smoothing, which the default plan tries on the scene's own mesh.
        widths_elsewhere: the same on the other meshes, and of the other smoothings.
        methods: that the default plan compares.
        largest_comparison: unknowns up to which the default plan compares methods: some of them are slow.
        tolerances: that the default plan tries.
        degrees: at which the default plan asks for these.
        accuracies: that the default plan asks of adaptive meshes, in the energy norm.
        reference_tolerance: relative residual at which the reference's iteration ends.
        steady: standard error of the median cost, relative, below which it is steady.
        fewest_runs: of a point, at least.
        longest_repeated: a run that takes more seconds is not repeated.
        patience: after so many seconds no further repetition of a point begins.
        time_limit: seconds after which a point is given up, unless the user says so.
        reference_limit: time limit of the reference, in that of a point.
        repetitions: of a point at most, unless the user says so.
        start: seconds that a point takes at least, as long as none is finished: interpreter, libraries, caches.
        seconds_per_unknown: as long as no point is finished.
        kill_after: seconds that a process has to end by itself.
        jump_facets: so many facets of the coarser mesh about a jump of the law count as near it.
        slowest_order: of the error in h that is believed; a missing one is taken for it.
        fastest_order: of the error in h that is believed.
        gain: an error must be smaller by this factor to be worth more time; above it two solutions are the same.
        resolved: an error tells an order of convergence if it is so many times the reference's own.
    """

    largest_point: Mapping[int, int] = field(default_factory=lambda: {2: 150_000, 3: 60_000})
    largest_reference: Mapping[int, int] = field(default_factory=lambda: {2: 400_000, 3: 250_000})
    coarser_meshes: int = 2
    finer_meshes: int = 1
    widths: tuple[str, ...] = ("exact", "1", "0.1", "0.01", "0.001")
    widths_elsewhere: tuple[str, ...] = ("exact", "0.1", "0.01")
    methods: tuple[str, ...] = ("auto", "snes_vi", "tao", "ssls", "condensed")
    largest_comparison: int = 20_000
    tolerances: tuple[str, ...] = ("1e-4", "1e-10")
    accuracies: tuple[str, ...] = ("0.1", "0.03")
    degrees: tuple[str, ...] = ("1", "2")
    reference_tolerance: float = 1e-10
    steady: float = 0.05
    fewest_runs: int = 3
    longest_repeated: float = 20.0
    patience: float = 15.0
    time_limit: float = 120.0
    reference_limit: float = 5.0
    repetitions: int = 9
    start: float = 3.0
    seconds_per_unknown: float = 1e-4
    kill_after: float = 5.0
    jump_facets: float = 2.0
    slowest_order: float = 0.5
    fastest_order: float = 2.0
    gain: float = 0.95
    resolved: float = 2.0


DEFAULT = Thresholds()
