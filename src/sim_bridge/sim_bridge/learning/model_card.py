# SPDX-License-Identifier: Apache-2.0
"""Model cards: every number in them is read from the policy's file or from results.json."""

import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

from risk_dqn_planner.policies.shipped import ShippedPolicy
from risk_dqn_planner.state.encoding import LANES, VEHICLES
from sim_bridge.learning.origin import Origin

Line = dict[str, Any]

_OUTCOMES = ("success", "collision", "timeout")

_USE = """\
## Intended use

Research, and simulation of high-level decisions at unsignalised, occluded intersections. The
policy chooses Stop, Slow or Fast twice a second from the situation node's state; something else
must keep the vehicle in its lane and from running into whatever it meets. It is no safety
function and has never driven a real vehicle.
"""

_UNTAUGHT = """\
- What it was not trained on, it was not taught: other maps, speeds, vehicle sizes and ways of
  giving way are outside its experience unless they stand in the results above.
"""

_PAPER_STATE = f"""\
- The state holds {VEHICLES} vehicles and {LANES} lanes, the most critical ones; it does not see
  the others.
"""

_OUTLOOK = f"""\
- The state holds {VEHICLES} vehicles and {LANES} lanes, the most critical ones; of the others it
  knows by the margins alone, which rest on traffic that keeps its speed.
- Sound is what the joint check calls so: if its assumptions are broken, it can collide; and it
  promises no progress.
"""

_LIMITS = """\
- Vehicles are assumed to follow their lanes; pedestrians and cyclists are out of scope.
- A network gives no reason for its choice. The risks shown with a decision are Algorithm 1's.
"""


def write_card(policy: ShippedPolicy, purpose: str, origin: Origin, lines: Sequence[Line]) -> None:
    """Write a policy's card. lines: those of results.json, of any policies."""
    parts = [
        f"# {policy.name}\n",
        "<!-- Written by `make ship`; do not edit. -->\n",
        _wrapped(purpose),
        _file(policy),
        _USE,
        _training(origin),
        _results(policy, origin, lines),
        _limits(policy, origin, lines),
    ]
    policy.card.write_text("\n".join(parts), encoding="utf-8")


def lines_of(policy: ShippedPolicy, lines: Iterable[Line]) -> list[Line]:
    """Return the lines of results.json that are of this very file, each cell once."""
    own = [line for line in lines if line["policy_hash"] == policy.sha256]
    return list({_cell(line): line for line in own}.values())


def _cell(line: Line) -> tuple[str, str, str, float]:
    return line["map"], line["traffic"], line["scenario"], line["sensor_range_m"]


def _siblings(policy: ShippedPolicy, origin: Origin, lines: Iterable[Line]) -> list[Line]:
    """Return the lines of policies trained alike with other seeds."""
    return [
        line
        for line in lines
        if line["policy"] in (policy.name, origin.name)
        and line["training_seed"] not in (None, origin.seed)
    ]


def _wrapped(text: str) -> str:
    return textwrap.fill(text, 100) + "\n"


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def _file(policy: ShippedPolicy) -> str:
    rows = [
        ["file", f"`{policy.path.name}`, {policy.path.stat().st_size} bytes"],
        ["SHA-256", f"`{policy.sha256}`"],
        ["licence", "Apache-2.0"],
    ]
    return _table(["what", "value"], rows)


def _training(origin: Origin) -> str:
    rows = [
        ["preset", origin.preset],
        ["reward", origin.reward],
        ["scenarios", ", ".join(origin.scenarios)],
        ["maps", ", ".join(origin.maps)],
        *([name, value] for name, value in origin.company),
        ["seed", str(origin.seed)],
        ["environment steps", str(origin.steps)],
        ["best on validation after", f"{origin.best_steps} steps"],
        ["git revision", f"`{origin.git_revision}`"],
        *([name, version] for name, version in origin.versions.items()),
    ]
    return "\n".join(
        ["## Training\n", _table(["what", "value"], rows), _validation(origin), _again(origin)]
    )


def _validation(origin: Origin) -> str:
    score = origin.validation
    shares = ", ".join(f"{name} {100.0 * score[name]:.1f} %" for name in _OUTCOMES)
    return _wrapped(
        f"All training data is simulated. On the {score['episodes']} validation episodes that "
        f"chose it: {shares}, mean speed {score['mean_speed_mps']:.2f} m/s."
    )


def _again(origin: Origin) -> str:
    revision = origin.git_revision.removesuffix("-dirty")
    remarks = ""
    if origin.git_revision in ("unknown", revision + "-dirty"):
        remarks = " (the sources were not exactly those of a revision)"
    return "\n".join(
        [
            f"To train it again, on a processor of the same kind to the same file{remarks}:\n",
            f"    git checkout {revision}",
            f"    {origin.command()}",
            f"    sha256sum {origin.folder()}/policy.pt\n",
        ]
    )


def _share(line: Line, outcome: str) -> str:
    share, episodes = line[outcome], line["episodes"]
    percent = ", ".join(f"{100.0 * share[key]:.1f}" for key in ("low", "high"))
    return f"{round(share['rate'] * episodes)} = {100.0 * share['rate']:.1f} % [{percent}]"


def _others(line: Line, siblings: Iterable[Line]) -> str:
    found = {s["training_seed"]: s for s in siblings if _cell(s) == _cell(line)}
    return "; ".join(
        f"{seed}: " + " / ".join(f"{100.0 * found[seed][name]['rate']:.1f}" for name in _OUTCOMES)
        for seed in sorted(found)
    )


def _results(policy: ShippedPolicy, origin: Origin, lines: Sequence[Line]) -> str:
    own = lines_of(policy, lines)
    if not own:
        return "## Results\n\nNot evaluated yet beyond the validation episodes.\n"
    siblings = _siblings(policy, origin, lines)
    header = ["map", "traffic", "scenario", "range", "episodes", *_OUTCOMES, "speed"]
    rows = []
    for line in own:
        speed = line["mean_speed_mps"]
        row = [line["map"], line["traffic"], line["scenario"], f"{line['sensor_range_m']:g} m"]
        row += [str(line["episodes"]), *(_share(line, outcome) for outcome in _OUTCOMES)]
        row += [f"{speed['mean']:.2f} [{speed['low']:.2f}, {speed['high']:.2f}]"]
        rows.append(row + ([_others(line, siblings)] if siblings else []))
    note = (
        "Episodes that neither training nor validation has seen. Each outcome as a count and as a "
        "share, with its 95 % interval in brackets (Wilson's); mean speed in m/s."
    )
    if siblings:
        header.append("other seeds: S / C / T in %")
        note += (
            " The last column holds policies trained alike with other seeds, each with its shares "
            "of success, collision and timeout: how much is luck of the training."
        )
    return f"## Results\n\n{_wrapped(note)}\n{_table(header, rows)}"


def _limits(policy: ShippedPolicy, origin: Origin, lines: Sequence[Line]) -> str:
    maps, scenarios = ", ".join(origin.maps), ", ".join(origin.scenarios)
    items = [f"- All it knows are the maps ({maps}) and scenarios ({scenarios}) of its training."]
    own = lines_of(policy, lines)
    if own:
        episodes = sum(line["episodes"] for line in own)
        collided = sum(round(line["collision"]["rate"] * line["episodes"]) for line in own)
        worst = min(own, key=lambda line: float(line["success"]["rate"]))
        map_name, traffic, scenario, range_m = _cell(worst)
        where = f"on {map_name}, {scenario} with {traffic} traffic, seen to {range_m:g} m"
        can = "It can collide" if collided else "Collisions"
        items += [
            f"- {can}: {collided} of all {episodes} episodes above ended so.",
            f"- Least success: {100.0 * worst['success']['rate']:.1f} %, {where}.",
        ]
    seen = _OUTLOOK if origin.looks else _PAPER_STATE
    return "## Known limits\n\n" + "\n".join(items) + "\n" + _UNTAUGHT + seen + _LIMITS
