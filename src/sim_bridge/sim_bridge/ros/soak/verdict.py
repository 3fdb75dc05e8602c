# SPDX-License-Identifier: Apache-2.0
"""What a soak found, and whether that is good enough."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

from sim_bridge.ros.soak.ledger import Ledger
from sim_bridge.ros.soak.processes import Usage
from sim_bridge.ros.soak.trend import Limits, Trend, thinned, trend

LONGEST_GAP_S = 1.0
_MB = 1e6
_SHOWN = 400  # samples that are written
_FEWEST = 10  # samples from which memory can be judged


class Sample(NamedTuple):
    """What each process holds, so long after the drive began [s of simulated time]."""

    driven_s: float
    usage: Mapping[str, Usage]


@dataclass(frozen=True)
class ProcessTrend:
    """How one process changed: memory [MB], and threads and open files at both ends."""

    name: str
    memory: Trend
    threads: tuple[int, int]
    files: tuple[int, int]

    def complaints(self, limits: Limits) -> list[str]:
        """Return what is wrong with it, a sentence each."""
        found = []
        if self.memory.growth > limits.growth_mb:
            found.append(
                f"{self.name} grows by {self.memory.growth:.1f} MB in an hour or the whole run, "
                f"expected at most {limits.growth_mb:g}"
            )
        if self.memory.ratio > limits.ratio:
            found.append(
                f"{self.name} ends with {self.memory.ratio:.3f} of the memory that it had after "
                f"the warm-up, expected at most {limits.ratio:g}"
            )
        for what, (begin, end) in (("threads", self.threads), ("open files", self.files)):
            if end > begin:
                found.append(f"{self.name} has {end} {what}, and {begin} after the warm-up")
        return found

    def document(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "memory_mb": {
                "after_warm_up": round(self.memory.begin, 2),
                "end": round(self.memory.end, 2),
                "end_by_begin": round(self.memory.ratio, 4),
                "slope_per_h": round(self.memory.slope_per_h, 3),
            },
            "threads": {"after_warm_up": self.threads[0], "end": self.threads[1]},
            "open_files": {"after_warm_up": self.files[0], "end": self.files[1]},
        }


@dataclass(frozen=True)
class Soak:
    """All that was seen. wall_s: real time from the first episode on. died: why it ended early."""

    samples: Sequence[Sample]
    ledger: Ledger
    errors: Counter[str]
    wall_s: float
    died: str = ""

    @property
    def driven_s(self) -> float:
        """Simulated time in all [s]."""
        return self.samples[-1].driven_s if self.samples else 0.0

    def trends(self, limits: Limits) -> list[ProcessTrend]:
        """Return how each process changed; nothing where there are too few samples to tell."""
        if len(self.samples) < _FEWEST or self.samples[-1].driven_s <= self.samples[0].driven_s:
            return []
        return [self._trend(name, limits) for name in self.samples[0].usage]

    def _trend(self, name: str, limits: Limits) -> ProcessTrend:
        hours = [sample.driven_s / 3600.0 for sample in self.samples]

        def of(values: Sequence[float]) -> Trend:
            return trend(hours, values, limits.warm_up)

        own = [sample.usage[name] for sample in self.samples]
        threads, files = of([u.threads for u in own]), of([u.files for u in own])
        return ProcessTrend(
            name=name,
            memory=of([u.resident_bytes / _MB for u in own]),
            threads=(round(threads.begin), round(threads.end)),
            files=(round(files.begin), round(files.end)),
        )

    def complaints(self, limits: Limits) -> list[str]:
        """Return why it does not pass, a sentence each; nothing where it does."""
        found = [self.died] if self.died else []
        trends = self.trends(limits)
        if not trends:
            found.append("the drive was too short to judge the memory")
        for process in trends:
            found += process.complaints(limits)
        if not self.ledger.episodes:
            found.append("no episode ended")
        if self.ledger.longest_gap_s > LONGEST_GAP_S:
            found.append(
                f"no decision for {self.ledger.longest_gap_s:.1f} s of simulated time within an "
                f"episode, expected at most {LONGEST_GAP_S:g} s"
            )
        if self.ledger.faults:
            names = ", ".join(f"{n} x {name}" for name, n in sorted(self.ledger.faults.items()))
            found.append(f"decisions within episodes were Stop for a fault: {names}")
        return found

    def document(self, limits: Limits, about: Mapping[str, Any]) -> dict[str, Any]:
        """Return all of it as JSON holds it."""
        complaints = self.complaints(limits)
        few = thinned(len(self.samples), _SHOWN).tolist() if self.samples else []
        return {
            "passed": not complaints,
            "complaints": complaints,
            **about,
            "limits": {**asdict(limits), "longest_gap_s": LONGEST_GAP_S},
            "simulated_h": round(self.driven_s / 3600.0, 4),
            "wall_s": round(self.wall_s, 1),
            "real_time_factor": round(self.driven_s / max(self.wall_s, 1e-9), 2),
            "episodes": dict(self.ledger.episodes),
            "decisions": self.ledger.decisions,
            "longest_gap_s": self.ledger.longest_gap_s,
            "late_decisions": self.ledger.late,
            "faults_within_episodes": dict(self.ledger.faults),
            "turned_into_error": dict(self.errors),
            "processes": {p.name: p.document() for p in self.trends(limits)},
            "series": {
                "driven_s": [round(self.samples[k].driven_s, 1) for k in few],
                "memory_mb": {
                    name: [round(self.samples[k].usage[name].resident_bytes / _MB, 2) for k in few]
                    for name in (self.samples[0].usage if self.samples else ())
                },
            },
        }


def write_json(file: Path, document: Mapping[str, Any]) -> None:
    """Write it whole or not at all."""
    fresh = file.with_suffix(".new")
    fresh.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    fresh.replace(file)
