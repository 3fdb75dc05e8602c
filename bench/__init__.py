# SPDX-License-Identifier: Apache-2.0
"""Measures the project beside its peers, in one run on one core: `make bench`.

`simulators`, `updates`, `latency`, `nodes` and `training` each measure one thing and return a
Section; `report` writes them to out/bench/bench.json; `__main__` runs them one after the other.
Times are the processor's unless a name says `wall`, so that a busy computer measures nearly the
same; only those of `nodes` are what others wait for. The packages' own benchmarks, which lie beside
them and are scripts too, are used from there.
"""

import sys
from pathlib import Path

_SOURCES = Path(__file__).resolve().parents[1] / "src"
sys.path += [str(_SOURCES / name / "benchmarks") for name in ("risk_dqn_planner", "sim_bridge")]
