# SPDX-License-Identifier: Apache-2.0
"""docs/timing.md from bench.json and soak.json: every number is measured, none typed.

python -m bench.nodes.page BENCH_JSON SOAK_JSON PAGE
"""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from shutil import copyfile
from typing import Any

from sim_bridge.evaluation.reporting.markdown import table

PICTURE = "images/soak.png"

_INTRODUCTION = """\
# Timing

<!-- Written by `make timing`; do not edit. -->

How late the nodes answer, how regularly they decide, and whether they can do so for hours: real
processes over real DDS, by the clock on the wall. `make timing` measures all of it again and writes
this page; `make bench` measures the first two tables with everything else, `make soak HOURS=...`
the last.

{machine}
"""

_DRIVES = """\
## Objects in, situation out; decisions at 2 Hz

`bench/nodes/driving.py` plays moving traffic and a visible area of 720 corners to both nodes ten
times a second in real time. *Situation*: from before the first of odometry, visible area and
objects is published until the situation of that stamp arrives. *Uneven*: how far the time between
the arrivals of two decisions is from 0.5 s (policy `tuned` with its supervisor reporting).
*Processor*: time that the situation node computed for each set of inputs, its timers included.
*Late*: situations that came after the next inputs or never.

*Loaded core*: situation node, policy node and a process that never waits, of the same priority, are
bound to one core. *All cores loaded*: such a process is bound to every core.
"""

_DECISIONS = """\
## Situation in, decision out

Decisions are taken by a timer, so in real time a situation waits up to half a second. Here the
simulated clock goes on first: the decision is due and lacks only its situation
(`bench/nodes/answering.py`). From before publishing a situation of 50 objects until the decision
arrives: transport both ways, conversion, policy, supervisor and explanation. Policies take turns,
and median and 99th percentile are the medians of the rounds. *Plain Python* is the same few lines
each time, without any node, after the same pause: what they vary by is the computer's own doing.
"""

_SOAK = """\
## An hour of driving

`make soak` drives one episode after the other with simulator, situation and policy node as fast as
they can, and looks at each process twice a second. The first {warm_up:.0%} of the time is warm-up.
It passes if afterwards no process grows by more than {growth_mb:g} MB an hour (Theil-Sen slope) or
ends above {ratio:g} of what it began with, has more threads or open files than before, no decision
within an episode is missing for more than {longest_gap_s:g} s of simulated time or is Stop for a
fault, and no node ends.
"""

_ADVICE = """\
## On a busy vehicle computer

- A process of the same priority on the same core costs what the table above says, nothing else need
  be done for 2 Hz. Where more than one competes for it, give the nodes the core
  (`taskset -c 3 ros2 run ...`) or a real-time class (`chrt --rr 10 ros2 run ...`; the user needs
  `rtprio` in `/etc/security/limits.conf`).
- `nice` has little effect between programs that were started in different sessions while the kernel
  groups processes by session (`/proc/sys/kernel/sched_autogroup_enabled` is 1), as most do.
- Both nodes run all of their callbacks in one thread, and numerical libraries in it too
  (`OMP_NUM_THREADS=1`): more threads would vary the time and not shorten it.
- What was loaded is exempt from garbage collection once a node is configured, and everything is
  compiled before it is ready: neither pauses a decision later.
"""


def write_page(
    bench: Mapping[str, Any], soak: Mapping[str, Any], picture: Path, page: Path
) -> None:
    """Write the page and, beside it, its picture."""
    parts = [
        _INTRODUCTION.format(machine=machine(bench, soak)),
        _DRIVES,
        drives(bench),
        _DECISIONS,
        decisions(bench),
        goals(bench),
        _SOAK.format(**soak["limits"]),
        soaked(soak),
        f"![Memory of the nodes along the simulated time]({PICTURE})\n",
        _ADVICE,
    ]
    (page.parent / PICTURE).parent.mkdir(parents=True, exist_ok=True)
    copyfile(picture, page.parent / PICTURE)
    page.write_text("\n".join(parts), encoding="utf-8")


def machine(bench: Mapping[str, Any], soak: Mapping[str, Any]) -> str:
    """Return where it was measured, and beside what."""
    about, versions = bench["machine"], bench["versions"]
    revision = str(versions["git_revision"])[:12]
    return (
        f"Measured on {about['processor']}, {about['cores']} cores, {about['system']}, Python "
        f"{versions['python']}, revision {revision}, on {about['begun'][:10]}. When it began, the "
        f"load of other work was {about['load_average_at_start']:.1f}; the soak drove "
        f"{soak['real_time_factor']:.1f} times as fast as real time."
    )


def drives(bench: Mapping[str, Any]) -> str:
    """Return the table of what was played in real time."""
    rows = []
    for name, found in bench["figures"]["nodes"]["drives"].items():
        situation, uneven, computed = found["situation"], found["uneven"], found["computed_ms"]
        rows.append(
            (
                name,
                *(f"{situation[key]:.1f}" for key in ("p50_ms", "p99_ms", "max_ms")),
                f"{found['late']} of {situation['timed']}",
                str(found["doubtful"]),
                *(f"{uneven[key]:.1f}" for key in ("p50_ms", "p99_ms", "max_ms")),
                str(uneven["timed"]),
                f"{computed['situation_node']:.1f}",
            )
        )
    header = (
        "drive", "situation p50 [ms]", "p99", "longest", "late", "faults", "uneven p50 [ms]", "p99",
        "largest", "intervals", "processor [ms]",
    )  # fmt: skip
    return table(header, rows)


def decisions(bench: Mapping[str, Any]) -> str:
    """Return the table of decisions by policy."""
    nodes = bench["figures"]["nodes"]
    timed = {**nodes["decision"], "plain Python": nodes["plain_work"]}
    rows = [
        (name, *(f"{took[key]:.1f}" for key in ("p50_ms", "p99_ms", "max_ms")), str(took["timed"]))
        for name, took in timed.items()
    ]
    return table(("policy", "p50 [ms]", "p99", "longest", "decisions"), rows)


def goals(bench: Mapping[str, Any]) -> str:
    """Return what was asked, and what came of it."""
    words = {True: "reached", False: "**missed**", None: "unknown"}
    rows = [
        (name, f"{goal['value']:.1f}", f"{goal['goal']['at_most']:g}", words[goal["reached"]])
        for name, goal in bench["goals"].items()
    ]
    return "## Goals\n\n" + table(("goal", "measured", "at most", ""), rows)


def soaked(soak: Mapping[str, Any]) -> str:
    """Return the table of the processes, and what was driven."""
    rows = []
    for name, found in soak["processes"].items():
        memory, threads, files = (found[key] for key in ("memory_mb", "threads", "open_files"))
        rows.append(
            (
                name,
                *(f"{memory[key]:.1f}" for key in ("after_warm_up", "end")),
                f"{memory['slope_per_h']:+.2f}",
                f"{threads['after_warm_up']} / {threads['end']}",
                f"{files['after_warm_up']} / {files['end']}",
            )
        )
    header = ("node", "after warm-up [MB]", "end", "slope [MB/h]", "threads", "open files")
    verdict = "It passes." if soak["passed"] else f"It fails: {'; '.join(soak['complaints'])}."
    return (
        f"{table(header, rows)}\n{soak['simulated_h']:.2f} h of simulated time in "
        f"{soak['wall_s'] / 60.0:.0f} min: {sum(soak['episodes'].values())} episodes, "
        f"{soak['decisions']} decisions, the longest time without one {soak['longest_gap_s']:g} s, "
        f"{soak['late_decisions']} late. {verdict}\n"
    )


def main(argv: Sequence[str]) -> int:
    """Write the page; 2 if a file is missing."""
    bench_file, soak_file, page = (Path(name) for name in argv)
    try:
        bench, soak = (json.loads(f.read_text(encoding="utf-8")) for f in (bench_file, soak_file))
        write_page(bench, soak, soak_file.with_name("memory.png"), page)
    except OSError as error:
        print(f"error: {error.filename}: {error.strerror}", file=sys.stderr)
        return 2
    print(page)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
