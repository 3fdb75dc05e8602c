# SPDX-License-Identifier: Apache-2.0
"""Measures everything in turn and writes out/bench/bench.json.

Interrupted, it has written what was measured so far. Exit code: 0 measured, whether the goals are
reached or not; 2 an option is no good; 130 interrupted.
"""

import argparse
import importlib
import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

from bench.machine import describe, stay_on_one_core, versions
from bench.options import QUICK, Effort
from bench.report import Report
from bench.timing import Stopwatch

# In the order of measuring. Loaded one by one, after the process is bound to its core.
SECTIONS = {
    "simulator": "bench.simulators",
    "updates": "bench.updates",
    "latency": "bench.latency",
    "nodes": "bench.nodes.section",
    "training": "bench.training",
}
INTERRUPTED = 130


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="bench", description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--quick", action="store_true", help="a short run: shows that it works, proves nothing")
    add("--sections", nargs="+", choices=SECTIONS, default=list(SECTIONS), metavar="SECTION",
        help=f"only these of {', '.join(SECTIONS)}")  # fmt: skip
    add("--sb3-limit-s", type=float, metavar="S",
        help="stop stable-baselines3 after so much time a setup [10 x ours + 60]")  # fmt: skip
    add("--paper-steps", type=int, metavar="N",
        help="steps of the preset paper; 400000 is all of it [20000]")  # fmt: skip
    add("--out", type=Path, default=Path("out/bench/bench.json"), help="[%(default)s]")
    chosen = parser.parse_args(argv)
    for name in ("sb3_limit_s", "paper_steps"):
        value = getattr(chosen, name)
        if value is not None and value <= 0:
            parser.error(f"--{name.replace('_', '-')} is {value}, expected more than 0")
    return chosen


def _effort(chosen: argparse.Namespace) -> Effort:
    effort = QUICK if chosen.quick else Effort()
    given = {
        name: getattr(chosen, name)
        for name in ("sb3_limit_s", "paper_steps")
        if getattr(chosen, name) is not None
    }
    return replace(effort, **given)


def announce(text: str) -> None:
    """Print at once, into a file too."""
    print(text, flush=True)


def main(argv: Sequence[str] | None = None) -> int:
    """Measure what the command line asks for."""
    chosen = _arguments(argv)
    effort = _effort(chosen)
    core = stay_on_one_core()
    about = {
        "quick": chosen.quick,
        "effort": asdict(effort),
        "machine": describe(core),
        "versions": versions(),
    }
    report = Report(about)
    watch = Stopwatch()
    try:
        for number, name in enumerate(chosen.sections, 1):
            announce(f"[{number}/{len(chosen.sections)}] {name} ...")
            section = importlib.import_module(SECTIONS[name]).measure(effort)
            report.sections[name] = section
            report.write(chosen.out, complete=number == len(chosen.sections))
            announce(f"      done after {watch.wall_s:.0f} s in all")
    except KeyboardInterrupt:
        announce(f"interrupted after {', '.join(report.sections) or 'nothing'}; see {chosen.out}")
        return INTERRUPTED
    announce(f"\n{report.table()}\n\n{chosen.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
