# SPDX-License-Identifier: Apache-2.0
"""What works under the supervisor, and what does not: variants of one training, several seeds each.

`python -m sim_bridge.learning.ablation` trains every variant with every seed, drives each policy
under the enforcing supervisor through test episodes, and writes table.md and results.json into the
output folder, and with --report a page. Run again, it goes on where it was. Exit code: 0 done, 2
an option is no good, 130 interrupted.
"""

import argparse
import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from risk_dqn_planner.errors import ConfigurationError, PlannerError
from risk_dqn_planner.policies.loading import load_policy
from risk_dqn_planner.policies.supervised import Supervisor
from risk_dqn_planner.policies.supervised_loading import is_sound
from sim_bridge.environment.episodes import DrivenEpisodes, drive
from sim_bridge.environment.place import Places
from sim_bridge.environment.seeds import TEST_SEEDS, fixed_seeds
from sim_bridge.folders import require_writable, writing_to
from sim_bridge.learning.checkpoint import POLICY, SAVE_EVERY_S, RunFolder
from sim_bridge.learning.export import initial_weights
from sim_bridge.learning.presets import preset_named
from sim_bridge.learning.run import Run
from sim_bridge.learning.session import Score, Session
from sim_bridge.learning.variants import MEANING, VARIANTS, Change
from sim_bridge.scenarios.loading import load_scenario
from sim_bridge.threads import compute_on_one_thread

INTERRUPTED = 130
SCENARIOS = "base,dense_traffic,severe_occlusion,close_small_obstacle"

Figures = dict[str, float]

# Means over a policy's episodes in all cells, in the order of the table.
COLUMNS = {
    "success": "success %",
    "collision": "collision %",
    "timeout": "timeout %",
    "mean_speed_mps": "speed m/s",
    "switch_share": "changes % of steps",
    "hard_brake_share": "hard brakes % of steps",
}


def figures_of(cells: Sequence[DrivenEpisodes]) -> Figures:
    """Return COLUMNS of all episodes together, shares in [0, 1]."""
    score = Score.of(cells)
    steps = sum(int(cell.statistics.action_counts.sum()) for cell in cells)
    changes = sum(int(cell.statistics.action_changes.sum()) for cell in cells)
    brakes = sum(int(cell.statistics.hard_brakes.sum()) for cell in cells)
    return {
        "success": score.success,
        "collision": score.collision,
        "timeout": score.timeout,
        "mean_speed_mps": score.mean_speed_mps,
        "switch_share": changes / steps,
        "hard_brake_share": brakes / steps,
    }


def table_of(results: Mapping[str, Sequence[Figures]], columns: Mapping[str, str]) -> str:
    """Return a table in Markdown: mean over the seeds, and the lowest and highest of them.

    columns: names of figures, and what stands above them.
    """
    lines = ["| variant | seeds | " + " | ".join(columns.values()) + " |"]
    lines += ["|" + " --- |" * (2 + len(columns))]
    for variant, seeds in results.items():
        cells = [_spread([one[name] for one in seeds], name) for name in columns]
        lines.append(f"| {variant} | {len(seeds)} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def page_of(results: Mapping[str, Sequence[Figures]], reference: Run, episodes: int) -> str:
    """Return the page about a comparison, in Markdown."""
    by_scenario = {name: f"{name} %" for name in reference.scenarios}
    meanings = [f"- `{name}`: {MEANING[name]}." for name in results]
    config = reference.config
    where = f"{', '.join(reference.map_names)} in\n{', '.join(reference.scenarios)}"
    about = (
        f"Preset `{config.preset}`, reward `{reference.reward}`, {config.steps} environment steps "
        f"on {where};\n{episodes} test episodes in each cell, the same ones for every policy and "
        "none of them seen in\ntraining. Every action taken is sound. Each entry is the mean over "
        "the seeds of the\ntrainings, with the lowest and the highest of them.\n"
    )
    return "\n".join(
        [
            "# What works under the supervisor\n",
            "<!-- Written by `make ablation`; do not edit. -->\n",
            about,
            *meanings,
            "\n## All cells\n",
            table_of(results, COLUMNS),
            "## Success by scenario\n",
            table_of(results, by_scenario),
        ]
    )


def _spread(values: Sequence[float], name: str) -> str:
    scale, digits = (1.0, 2) if name == "mean_speed_mps" else (100.0, 1)
    mean, low, high = (
        f"{scale * each:.{digits}f}" for each in (np.mean(values), min(values), max(values))
    )
    return f"{mean} [{low}, {high}]"


def _train(run: Run, places: Sequence[Places], folder: Path) -> None:
    """Train to the end, or go on with it, unless it is done already."""
    files = RunFolder(folder, run)
    if files.finished:
        return
    session = Session(run, places, initial_weights(run.seed, run.outlook_size))
    files.resume(session)
    for _ in session.run():
        files.save(session, every_s=SAVE_EVERY_S)
    files.finish(session, folder.name)


def _drive(run: Run, places: Sequence[Places], policy: Path, episodes: int) -> Figures:
    """Drive test episodes in each cell of the run, under the enforcing supervisor."""
    learned = load_policy(str(policy), assumptions=run.assumptions)
    driver = learned if is_sound(learned) else Supervisor(learned, assumptions=run.assumptions)
    seeds = fixed_seeds(TEST_SEEDS, episodes)
    scenarios = {name: load_scenario(name) for name in run.scenarios}
    cells = {
        name: [
            drive(place.of(scenario).simulation(scenario, episodes, run.memory), driver, seeds)
            for place in places
        ]
        for name, scenario in scenarios.items()
    }
    shares = {name: figures_of(parts)["success"] for name, parts in cells.items()}
    return figures_of([part for parts in cells.values() for part in parts]) | shares


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="ablation", description=__doc__)
    add = parser.add_argument
    add("--variants", default=",".join(VARIANTS), help="names, by commas [%(default)s]")
    add("--seeds", default="0,1,2", help="of the trainings, by commas [%(default)s]")
    add("--preset", default="advised", help="of the reference [%(default)s]")
    add("--steps", type=int, help="environment steps instead of the preset's")
    add("--map", default="four_way", help="own maps, by commas [%(default)s]")
    add("--scenario", default=SCENARIOS, help="names or .yaml files, by commas [%(default)s]")
    add("--episodes", type=int, default=1000, help="test episodes in each cell [%(default)s]")
    add("--report", type=Path, help="also write a page here")
    add("--out", type=Path, default=Path("out/ablation"), help="folder [%(default)s]")
    return parser.parse_args(argv)


def _reference(arguments: argparse.Namespace) -> Run:
    config = preset_named(arguments.preset)
    if arguments.steps is not None:
        config = replace(config, steps=arguments.steps)
    return Run(
        config=config,
        reward="progress",
        seed=0,
        map_name=arguments.map,
        scenario=arguments.scenario,
        supervisor="enforce",
    )


def _changes(names: Iterable[str]) -> dict[str, Change]:
    changes = {}
    for name in names:
        if name not in VARIANTS:
            raise ConfigurationError(
                f"there is no variant '{name}', expected one of: {', '.join(VARIANTS)}"
            )
        changes[name] = VARIANTS[name]
    return changes


def _seeds(text: str) -> list[int]:
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise ConfigurationError(f"seeds is '{text}', expected whole numbers by commas") from None


def _compare(arguments: argparse.Namespace) -> None:
    reference, changes = _reference(arguments), _changes(arguments.variants.split(","))
    seeds, out = _seeds(arguments.seeds), arguments.out
    places = [Places.named(name) for name in reference.map_names]
    results: dict[str, list[Figures]] = {}
    require_writable(arguments.report)
    with writing_to(out):
        for name, change in changes.items():
            for seed in seeds:
                run, folder = replace(change(reference), seed=seed), out / f"{name}_seed{seed}"
                _train(run, places, folder)
                figures = _drive(run, places, folder / POLICY, arguments.episodes)
                results.setdefault(name, []).append(figures)
                print(f"{folder}: {figures}", flush=True)
                (out / "results.json").write_text(json.dumps(results, indent=1) + "\n", "utf-8")
                (out / "table.md").write_text(table_of(results, COLUMNS), encoding="utf-8")
        if arguments.report is not None:
            page = page_of(results, reference, arguments.episodes)
            arguments.report.write_text(page, encoding="utf-8")
    print(table_of(results, COLUMNS))


def main(argv: Sequence[str] | None = None) -> int:
    """Compare the variants as the command line says."""
    compute_on_one_thread()
    try:
        _compare(_arguments(argv))
    except PlannerError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return INTERRUPTED
    return 0


if __name__ == "__main__":
    sys.exit(main())
