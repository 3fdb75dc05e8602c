# SPDX-License-Identifier: Apache-2.0
"""Training: preset `tuned` to a share of success, the preset `paper` a step, and a peer's DQN."""

import os
from collections.abc import Sequence
from dataclasses import replace
from statistics import median

from bench.options import Effort
from bench.progress import say
from bench.report import Goal, Section
from bench.success import EPISODES, LEVELS, Reached
from bench.timing import Stopwatch
from sim_bridge.environment.episodes import drive
from sim_bridge.environment.interface import Outcome
from sim_bridge.environment.place import Places
from sim_bridge.environment.seeds import VALIDATION_SEEDS, fixed_seeds
from sim_bridge.learning.config import EvaluationConfig, TrainingConfig
from sim_bridge.learning.export import initial_weights
from sim_bridge.learning.presets import preset_named
from sim_bridge.learning.run import Run
from sim_bridge.learning.session import Session
from sim_bridge.scenarios.loading import load_scenario

MAP, SCENARIO, REWARD = "four_way", "base", "risk"
PAPER_STEPS = 400_000
GOAL_PAPER_MIN, GOAL_TUNED_S, GOAL_OVER_SB3 = 10.0, 60.0, 10.0
# The session's own validation is left to its end: what is reached when is found out here.
LOOKS = EvaluationConfig(
    every_episodes=250, episodes=1, validation_every=1_000_000, validation_episodes=1
)
SB3_MARGIN_S = 60.0
COMMON_LEVEL, HIGH_LEVEL = 0.9, 0.99
NOTES = (
    (
        f"Success is that of the greedy policy on the same {EPISODES} validation episodes for "
        "all; a level counts as reached at the first validation that shows it."
    ),
    (
        "ours: preset tuned, validated every 250 episodes, time of validating left out; median"
        " over seeds, each on its own."
    ),
    (
        "stable-baselines3: its DQN on the same Gymnasium environment, network of 120 x 120 on"
        " the flat state, validated every 5,000 steps, time of validating left out; one seed a"
        " setup. The ratio takes the setup that got there first."
    ),
    (
        "paper: measured over fewer steps, evaluation as in the preset included, extrapolated "
        f"to {PAPER_STEPS:,}."
    ),
)


def _session(config: TrainingConfig, seed: int, places: Places) -> Session:
    run = Run(config, REWARD, seed, MAP, SCENARIO)
    return Session(run, [places], initial_weights(seed))


def compile_all(places: Places) -> None:
    """Train a little, so that no later measurement waits for the compiler."""
    for name in ("tuned", "paper"):
        config = preset_named(name)
        steps = 2 * max(config.warmup_steps, config.environments)
        for _ in _session(replace(config, steps=steps), 0, places).run():
            pass


def time_ours(places: Places, seed: int, limit_s: float) -> Reached:
    """Train the preset `tuned` until the highest level is reached or the time is over."""
    session = _session(replace(preset_named("tuned"), evaluation=LOOKS), seed, places)
    scenario = load_scenario(SCENARIO)
    validation = places.of(scenario).simulation(scenario, EPISODES)
    seeds = fixed_seeds(VALIDATION_SEEDS, EPISODES)
    reached, watch = Reached(), Stopwatch()
    for record in session.run():
        with watch.stopped():
            success = drive(validation, session.policy(), seeds).share(Outcome.SUCCESS)
        reached.look(success, watch.cpu_s, watch.wall_s, record.steps)
        if reached.done or watch.cpu_s > limit_s:
            break
    return reached


def paper_ms_a_step(places: Places, steps: int) -> tuple[float, float]:
    """Return the milliseconds (processor, of the day) that a step of the preset `paper` takes.

    The first steps, in which nothing is learned yet, are left out. Exploration falls as in a
    whole run, only sooner.
    """
    session = _session(replace(preset_named("paper"), steps=steps), 0, places)
    watch = Stopwatch()
    begin = (0, 0.0, 0.0)
    for record in session.run():
        now = (record.steps, watch.cpu_s, watch.wall_s)
        if begin[0] == 0 and record.updates and record.steps < steps:
            begin = now
    taken, cpu_s, wall_s = (end - start for end, start in zip(now, begin, strict=True))
    return 1e3 * cpu_s / taken, 1e3 * wall_s / taken


def typical(runs: Sequence[Reached], level: float) -> float | None:
    """Return the median time to a level, None if not every run reached it."""
    times = [run.seconds_to(level) for run in runs]
    known = [time for time in times if time is not None]
    return median(known) if len(known) == len(times) else None


def compare(ours_s: float | None, peers: Sequence[Reached], level: float) -> Goal:
    """Return how many times longer the fastest peer took; at least so long if none arrived."""
    name = f"training: stable-baselines3's time over ours, to {level:.0%}"
    arrived = [time for peer in peers if (time := peer.seconds_to(level)) is not None]
    if ours_s is None or not peers:
        return Goal(name, None, GOAL_OVER_SB3)
    peer_s = min(arrived) if arrived else min(peer.cpu_s for peer in peers)
    return Goal(name, peer_s / ours_s, GOAL_OVER_SB3, lower_bound=not arrived)


def measure(effort: Effort) -> Section:
    """Train ours, the paper's preset for a while, and the peer."""
    places = Places.named(MAP)
    say("compiling")
    compile_all(places)
    ours = []
    for seed in range(effort.seeds):
        ours.append(time_ours(places, seed, effort.ours_limit_s))
        say(f"ours, seed {seed}: success {ours[-1].best:.1%} after {ours[-1].cpu_s:.0f} s")
    say(f"preset paper, {effort.paper_steps} steps")
    cpu_ms, wall_ms = paper_ms_a_step(places, effort.paper_steps)
    tuned_s = typical(ours, HIGH_LEVEL)
    peers, missing = _peers(places, tuned_s, effort)
    minutes = cpu_ms * PAPER_STEPS / 60e3
    return Section(
        figures={
            "tuned_by_seed": [run.document() for run in ours],
            "tuned_median_cpu_s": {
                f"success_{level:.0%}": typical(ours, level) for level in LEVELS
            },
            "paper_cpu_ms_a_step": cpu_ms,
            "paper_wall_ms_a_step": wall_ms,
            "paper_measured_steps": effort.paper_steps,
            "paper_extrapolated_cpu_min": minutes,
            "stable_baselines3": {name: run.document() for name, run in peers.items()},
        },
        ratios=tuple(
            compare(typical(ours, level), list(peers.values()), level)
            for level in (COMMON_LEVEL, HIGH_LEVEL)
        ),
        goals=(
            Goal("training: tuned to 99% success [s]", tuned_s, GOAL_TUNED_S, at_most=True),
            Goal("training: paper, 400,000 steps [min]", minutes, GOAL_PAPER_MIN, at_most=True),
        ),
        notes=NOTES,
        missing=missing,
    )


def _peers(
    places: Places, tuned_s: float | None, effort: Effort
) -> tuple[dict[str, Reached], dict[str, str]]:
    """Train stable-baselines3 in each of its setups; return what they reached, or why not."""
    try:
        from bench import stable_baselines  # noqa: PLC0415 (a peer, may be missing)
    except ImportError as error:
        return {}, {"stable-baselines3": os.environ.get("PEERS_MISSING", "") or str(error)}
    limit_s = effort.sb3_limit_s
    if limit_s is None:
        limit_s = GOAL_OVER_SB3 * (tuned_s or effort.ours_limit_s) + SB3_MARGIN_S
    trained = {}
    for name, setup in stable_baselines.SETUPS.items():
        say(f"stable-baselines3, {name}, at most {limit_s:.0f} s")
        trained[name] = stable_baselines.train(setup, places.usual, limit_s)
    return trained, {}
