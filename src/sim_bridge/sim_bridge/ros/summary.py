# SPDX-License-Identifier: Apache-2.0
"""What came of a run: one result an episode, as JSON and as a table."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from intersection_msgs.msg import Decision, EpisodeEvent
from rclpy.serialization import deserialize_message
from rich.table import Table

from sim_bridge.ros.recording import Stored
from sim_bridge.ros.run_settings import RunSettings
from sim_bridge.ros.topics import DECISION

RESULTS = {
    EpisodeEvent.SUCCESS: "success",
    EpisodeEvent.COLLISION: "collision",
    EpisodeEvent.TIMEOUT: "timeout",
}
ACTIONS = ("stop", "slow", "fast")
_COLORS = {"success": "green", "collision": "red", "timeout": "yellow"}


@dataclass(frozen=True)
class EpisodeResult:
    """How one episode went; `action_counts` are decision steps by action."""

    seed: int
    result: str
    duration_s: float
    mean_speed_mps: float
    action_counts: dict[str, int]
    late_decisions: int


@dataclass(frozen=True)
class RunSummary:
    """Everything needed to run the same again, and what came of it."""

    map: str
    route: tuple[int, ...]
    origin: tuple[float, float]
    projector: str
    policy: str
    policy_hash: str
    supervisor: str
    memory: str
    scenario: str
    episodes: tuple[EpisodeResult, ...]

    def write(self, file: Path) -> None:
        """Write as JSON."""
        file.write_text(json.dumps(asdict(self), indent=2) + "\n", "utf-8")


def episode_result(event: EpisodeEvent) -> EpisodeResult:
    """Convert the event that ended an episode."""
    counts = {name: int(n) for name, n in zip(ACTIONS, event.action_counts, strict=True)}
    return EpisodeResult(
        seed=event.seed,
        result=RESULTS[event.event],
        duration_s=round(event.duration_s, 3),
        mean_speed_mps=round(event.mean_speed_mps, 3),
        action_counts=counts,
        late_decisions=event.late_decisions,
    )


def run_summary(
    settings: RunSettings, messages: Sequence[Stored], episodes: Sequence[EpisodeResult]
) -> RunSummary:
    """Put settings and results together; the policy's name and hash are those it goes by."""
    name, policy_hash = settings.policy, ""
    decisions = [message for message in messages if message.topic == DECISION.name]
    if decisions:
        last = deserialize_message(decisions[-1].data, Decision)
        name, policy_hash = last.policy_name, last.policy_hash
    return RunSummary(
        map=settings.map_name,
        route=settings.route,
        origin=(settings.origin.latitude_deg, settings.origin.longitude_deg),
        projector=settings.projector,
        policy=name,
        policy_hash=policy_hash,
        supervisor=settings.supervisor,
        memory=settings.memory,
        scenario=settings.scenario,
        episodes=tuple(episodes),
    )


def progress_line(episode: EpisodeResult, number: int, count: int) -> str:
    """Say how an episode went, with rich's markup."""
    color = _COLORS[episode.result]
    return (
        f"episode {number}/{count} (seed {episode.seed}): [{color}]{episode.result}[/{color}] "
        f"after {episode.duration_s:.1f} s at {episode.mean_speed_mps:.2f} m/s"
    )


def results_table(episodes: Sequence[EpisodeResult], title: str) -> Table:
    """Lay out the episodes, and their totals in a last row."""
    table = Table(title=title)
    table.add_column("seed", justify="right")
    table.add_column("result")
    for name in ("duration [s]", "mean speed [m/s]", *ACTIONS, "late"):
        table.add_column(name, justify="right")
    for episode in episodes:
        color = _COLORS[episode.result]
        table.add_row(
            str(episode.seed),
            f"[{color}]{episode.result}[/{color}]",
            f"{episode.duration_s:.1f}",
            f"{episode.mean_speed_mps:.2f}",
            *(str(episode.action_counts[name]) for name in ACTIONS),
            str(episode.late_decisions),
        )
    if episodes:
        table.add_section()
        table.add_row(*_totals(episodes))
    return table


def _totals(episodes: Sequence[EpisodeResult]) -> list[str]:
    successes = sum(episode.result == "success" for episode in episodes)
    driven_m = sum(episode.mean_speed_mps * episode.duration_s for episode in episodes)
    duration_s = sum(episode.duration_s for episode in episodes)
    return [
        "all",
        f"{successes}/{len(episodes)} success",
        f"{duration_s:.1f}",
        f"{driven_m / duration_s if duration_s > 0.0 else 0.0:.2f}",
        *(str(sum(episode.action_counts[name] for episode in episodes)) for name in ACTIONS),
        str(sum(episode.late_decisions for episode in episodes)),
    ]
