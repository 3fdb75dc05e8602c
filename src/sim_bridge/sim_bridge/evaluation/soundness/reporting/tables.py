# SPDX-License-Identifier: Apache-2.0
"""Tables of the set `soundness`, from the lines of its results.json."""

from collections.abc import Callable, Iterable, Sequence

from risk_dqn_planner.safety.assumptions import NO_CAP_MPS
from sim_bridge.evaluation.clairvoyant import NAME as CLAIRVOYANT
from sim_bridge.evaluation.reporting.markdown import NOTHING, OUTCOMES, table
from sim_bridge.evaluation.reporting.selection import Line, center_of
from sim_bridge.evaluation.soundness.limits import SOUND_LIMIT

LIMITS = (CLAIRVOYANT, SOUND_LIMIT)
# What the project asks of a sound policy, relative to the sound limit.
SUCCESS_WANTED, SPEED_WANTED = 0.97, 0.95


def part_of(lines: Iterable[Line], part: str) -> list[Line]:
    """Return the lines of one part of the set."""
    return [line for line in lines if line["part"] == part]


def policies_of(lines: Iterable[Line]) -> list[str]:
    """Return the policies, limits left out, in their order of appearance."""
    names = dict.fromkeys(line["policy"] for line in lines)
    return [name for name in names if name not in LIMITS]


def is_alarming(line: Line) -> bool:
    """Tell whether something collided that cannot."""
    promised = line["sound"] and line["assumptions_hold"]
    return bool(promised and line["collision"]["rate"] > 0.0)


def count(line: Line) -> int:
    """Return the number of collisions."""
    return round(float(line["collision"]["rate"]) * int(line["episodes"]))


def per_cent(share: Line | None) -> str:
    """Return a share in percent, with as many digits as tell it from 0 or 100."""
    if share is None:
        return NOTHING
    return f"{100 * share['rate']:.1f}"


def with_interval(value: Line | None, factor: float = 1.0, digits: int = 1) -> str:
    """Return a share or mean with its interval."""
    if value is None:
        return NOTHING
    low, high = factor * value["low"], factor * value["high"]
    return f"{factor * center_of(value):.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def outcome(line: Line | None) -> str:
    """Return success / collision / timeout in percent; a broken promise stands out."""
    if line is None:
        return NOTHING
    success, collision, timeout = (per_cent(line[key]) for key in OUTCOMES)
    if is_alarming(line):
        collision = f"🔴 **{count(line)} collisions**"
    return f"{success} / {collision} / {timeout}"


def where(line: Line) -> str:
    """Return what a row of the set's tables is called."""
    place = "centre" if line["sensor_forward_m"] == 0.0 else "front"
    return f"{line['scenario'].replace('_', ' ')}, {place}"


def top_speed(line: Line) -> str:
    """Return the highest speed ascribed to hidden vehicles."""
    mps = line["hidden_top_speed_mps"]
    return "the limit (sound)" if mps == NO_CAP_MPS else f"{mps:g}"


def by_traffic(lines: Iterable[Line]) -> dict[str, list[Line]]:
    """Return the lines by how traffic treats the ego, in words."""
    found: dict[str, list[Line]] = {}
    for line in lines:
        after_s = line["brakes_for_ego_after_s"]
        name = "Traffic that never yields"
        if after_s is not None:
            name = f"Traffic that brakes {after_s:g} s after it could see the ego"
        found.setdefault(name, []).append(line)
    return found


def by_map(
    lines: Sequence[Line], policy: str, show: Callable[[Line | None], str], title: str
) -> str:
    """Return a table of one policy: a row for each scenario and sensor, a column for each map."""
    own = [line for line in lines if line["policy"] == policy]
    maps = list(dict.fromkeys(line["map"] for line in own))
    rows = []
    for name in dict.fromkeys(where(line) for line in own):
        found = {line["map"]: line for line in own if where(line) == name}
        rows.append([name, *(show(found.get(each)) for each in maps)])
    return table([title, *maps], rows)


def limits_of(line: Line | None) -> str:
    """Return success of both limits in percent, and their mean speeds are elsewhere."""
    if line is None:
        return NOTHING
    limits = line["limits"]
    return f"{per_cent(limits['clairvoyant'])} / {per_cent(limits['sound_limit'])}"


def reached(lines: Sequence[Line]) -> Callable[[Line | None], str]:
    """Return what shows success and speed of a line relative to the sound limit of its cell."""
    shares = _shares_of_limit(lines)

    def show(line: Line | None) -> str:
        found = None if line is None else shares(line)
        if found is None:
            return NOTHING
        return " / ".join(
            f"{100 * value:.0f}" if value >= wanted else f"*{100 * value:.0f}*"
            for value, wanted in zip(found, (SUCCESS_WANTED, SPEED_WANTED), strict=True)
        )

    return show


def cells_reached(lines: Sequence[Line], policies: Iterable[str]) -> str:
    """Return in how many cells each policy comes as near to the sound limit as is wanted."""
    shares = _shares_of_limit(lines)
    rows = []
    for policy in policies:
        own = [shares(line) for line in lines if line["policy"] == policy]
        known = [found for found in own if found is not None]
        success = [share >= SUCCESS_WANTED for share, _ in known]
        speed = [share >= SPEED_WANTED for _, share in known]
        both = [all(pair) for pair in zip(success, speed, strict=True)]
        counts = (len(known), sum(success), sum(speed), sum(both))
        rows.append([policy, *(str(number) for number in counts)])
    header = [
        "policy", "cells", f"success at least {100 * SUCCESS_WANTED:.0f}%",
        f"speed at least {100 * SPEED_WANTED:.0f}%", "both",
    ]  # fmt: skip
    return table(header, rows)


def _shares_of_limit(lines: Sequence[Line]) -> Callable[[Line], tuple[float, float] | None]:
    """Return what gives success and mean speed of a line as shares of its cell's sound limit."""
    limits = {(line["map"], where(line)): line for line in lines if line["policy"] == SOUND_LIMIT}

    def shares(line: Line) -> tuple[float, float] | None:
        limit = limits.get((line["map"], where(line)))
        if limit is None or limit["limits"]["sound_limit"]["rate"] <= 0.0:
            return None
        success = line["limits"]["success"]["rate"] / limit["limits"]["sound_limit"]["rate"]
        speed = line["limits"]["mean_speed_mps"]["mean"] / limit["mean_speed_mps"]["mean"]
        return success, speed

    return shares


def timeouts(lines: Sequence[Line]) -> str:
    """Return why each policy timed out, over all cells whose limits are known."""
    rows = []
    for policy in policies_of(lines):
        own = [line["timeouts"] for line in lines if line["policy"] == policy]
        sums = [sum(each[key] for each in own) for key in ("episodes", *_CAUSES)]
        rows.append([policy, *(str(number) for number in sums)])
    return table(["policy", "episodes", "impossible", "price of soundness", "missed"], rows)


_CAUSES = ("impossible", "price", "missed")


def smoothness(lines: Sequence[Line]) -> str:
    """Return how smoothly the policies drive."""
    rows = [
        [
            line["policy"],
            line["map"],
            with_interval(line["switch_share"], 100.0),
            with_interval(line["hard_brake_share"], 100.0),
            with_interval(line["mean_speed_mps"], 1.0, 2),
        ]
        for line in lines
    ]
    header = ["policy", "map", "decisions that change, %", "hard brakes, %", "mean speed, m/s"]
    return table(header, rows)


def at_a_glance(lines: Sequence[Line]) -> str:
    """Return how each policy does over all cells together: means of the cells' own means.

    Of the decisions that change also the share of all decisions taken, where long episodes count.
    """
    keys = {
        "success": 100.0,
        "mean_speed_mps": 1.0,
        "switch_share": 100.0,
        "hard_brake_share": 100.0,
    }
    rows = []
    for policy in policies_of(lines):
        own = [line for line in lines if line["policy"] == policy]
        means = [
            factor * sum(center_of(line[key]) for line in own) / len(own)
            for key, factor in keys.items()
        ]
        success, mps, changes, brakes = means
        pooled = 100.0 * _changes_of_all(own)
        figures = (
            f"{success:.1f}", f"{mps:.2f}", f"{changes:.1f}", f"{pooled:.1f}", f"{brakes:.1f}",
        )  # fmt: skip
        rows.append([policy, str(len(own)), *figures, str(sum(map(count, own)))])
    header = [
        "policy", "cells", "success, %", "mean speed, m/s", "decisions that change, %",
        "of all decisions, %", "hard brakes, %", "collisions",
    ]  # fmt: skip
    return table(header, rows)


def _changes_of_all(lines: Sequence[Line]) -> float:
    """Return the share of changes in the decisions of all cells together."""
    changes = sum(center_of(line["switches_per_episode"]) * int(line["episodes"]) for line in lines)
    decisions = sum(
        center_of(mean) * int(line["episodes"])
        for line in lines
        for mean in line["actions_per_episode"].values()
    )
    return changes / decisions


def collisions_in_all(lines: Sequence[Line]) -> str:
    """Return collisions over all cells whose assumptions hold, and the cells that had any."""
    rows = []
    for policy in policies_of(lines):
        own = [line for line in lines if line["policy"] == policy and line["assumptions_hold"]]
        hits = sum(count(line) for line in own)
        worst = max(own, key=lambda line: float(line["collision"]["rate"]))
        total = sum(line["episodes"] for line in own)
        alarm = any(is_alarming(line) for line in own)
        shown = f"🔴 **{hits}**" if alarm else str(hits)
        highest = f"{100 * worst['collision']['high']:.3f}%"
        rows.append([policy, str(len(own)), str(total), shown, highest])
    header = ["policy", "cells", "episodes", "collisions", "the worst cell's interval ends at"]
    return table(header, rows)


def full(lines: Sequence[Line], first: Callable[[Line], str], title: str) -> str:
    """Return lines with the intervals of what matters, `first` saying what each is."""
    rows = [
        [
            first(line),
            line["policy"],
            with_interval(line["success"], 100.0),
            (f"🔴 **{count(line)}**: " if is_alarming(line) else "")
            + with_interval(line["collision"], 100.0, 3),
            with_interval(line["mean_speed_mps"], 1.0, 2),
            with_interval(line["crossing_time_s"], 1.0, 1),
            str(line["episodes"]),
        ]
        for line in lines
    ]
    header = [
        title, "policy", "success, %", "collision, %", "speed, m/s", "crossing, s", "episodes",
    ]  # fmt: skip
    return table(header, rows)
