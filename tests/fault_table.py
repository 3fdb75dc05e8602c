# SPDX-License-Identifier: Apache-2.0
"""Measures how the planner reacts to every fault and writes the table of docs/faults.md."""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).parent))

from fault_cases import CASES, ERROR, OK, STALE, WARN, Case
from fault_driver import SIMULATED, FaultDriver, Reaction, fault_nodes
from fault_verdict import complaints

BEGIN, END = "<!-- measured -->", "<!-- end of measured -->"
LEVELS = {OK: "OK", WARN: "WARN", ERROR: "ERROR", STALE: "STALE"}
HEADER = (
    "Repetitions of each fault: {phases}.\n{summary}\n"
    "| input | fault | decision | reason | at fault | diagnostics of the input | "
    "time to react [s] | time to recover [s] |\n|---|---|---|---|---|---|---|---|\n"
)
PHASES = 5  # frames from one decision to the next


def spread(times_s: Sequence[float | None]) -> str:
    """Median and maximum."""
    known = [time_s for time_s in times_s if time_s is not None]
    return f"{median(known):.1f} / {max(known):.1f}" if known else "-"


def row(case: Case, reactions: Sequence[Reaction]) -> str:
    """One line of the table."""
    if case.told is None:
        level = LEVELS[case.level or OK]
        cells = [str(case.source), case.name, "the policy's", "-", "-", level, "-", "-"]
    else:
        name = f"situation: {case.told.source}"
        seen = sorted({LEVELS[r.levels[name]] for r in reactions if r.levels and name in r.levels})
        cells = [
            str(case.source), case.name, "Stop", case.told.reason.name, str(case.told.source),
            ", ".join(seen) or "-", spread([r.react_s for r in reactions]),
            spread([r.recover_s for r in reactions]),
        ]  # fmt: skip
    return f"| {' | '.join(cells)} |\n"


def slowest(cases: Sequence[Case], measured: Sequence[Sequence[Reaction]]) -> str:
    """The sentences before the table: the longest times, by how long they may take."""
    found: dict[str, dict[float, float]] = {"react": {}, "recover": {}}
    for case, reactions in zip(cases, measured, strict=True):
        allowed = {"react": case.reaction_s, "recover": case.recovery_s}
        for reaction in reactions if case.told is not None else ():
            times = {"react": reaction.react_s, "recover": reaction.recover_s}
            for kind, time_s in times.items():
                if time_s is not None:
                    before_s = found[kind].get(allowed[kind], 0.0)
                    found[kind][allowed[kind]] = max(before_s, time_s)
    return "".join(
        f"Longest time to {kind}: "
        + "; ".join(f"{took:.1f} s where {limit:.1f} s is allowed" for limit, took in times)
        + ".\n"
        for kind, times in ((kind, sorted(by.items())) for kind, by in found.items())
        if times
    )


def measure(cases: Sequence[Case], phases: int) -> tuple[list[str], str, list[str]]:
    """Return the table's lines, the sentences before them, and what was not as it must be."""
    lines, wrong, measured = [], [], []
    with tempfile.TemporaryDirectory() as logs, fault_nodes(Path(logs), SIMULATED) as running:
        driver = FaultDriver(*running)
        driver.meet()
        for case in cases:
            began_s = time.monotonic()
            begins = [PHASES * k // phases for k in range(phases)]
            reactions = [driver.suffer(case, phase) for phase in begins]
            found = [text for reaction in reactions for text in complaints(case, reaction)]
            wrong += [f"{case.title}: {text}" for text in found]
            lines.append(row(case, reactions))
            measured.append(reactions)
            took_s = time.monotonic() - began_s
            print(f"{lines[-1].strip()} {took_s:.1f} s {found or ''}", flush=True)
    return lines, slowest(cases, measured), wrong


def written(text: str, summary: str, lines: Sequence[str], phases: int) -> str:
    """Put what was measured between the marks of a document."""
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    return (
        f"{head}{BEGIN}\n{HEADER.format(phases=phases, summary=summary)}{''.join(lines)}{END}{tail}"
    )


def main() -> int:
    """Run the command; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="document whose table is replaced")
    parser.add_argument("--only", default="", help="faults whose title contains this")
    parser.add_argument("--phases", type=int, default=PHASES, choices=range(1, PHASES + 1))
    options = parser.parse_args()
    if options.out is not None and options.only:
        parser.error("a document gets the whole table, so leave out --only or --out")
    chosen = [case for case in CASES if options.only in case.title]
    lines, summary, wrong = measure(chosen, options.phases)
    print(summary)
    if options.out is not None:
        text = options.out.read_text(encoding="utf-8")
        options.out.write_text(written(text, summary, lines, options.phases), encoding="utf-8")
    for text in wrong:
        print(f"error: {text}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
