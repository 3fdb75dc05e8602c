# SPDX-License-Identifier: Apache-2.0
"""Trains a policy; run again with the same options, it goes on where it was interrupted.

Writes policy.pt (the best on the validation episodes), history.json, result.json and TensorBoard
logs into the output folder. Exit code: 0 trained, 2 an option is no good, 130 interrupted.
"""

import argparse
import dataclasses
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from risk_dqn_planner.errors import ConfigurationError, PlannerError
from sim_bridge.environment.place import Places
from sim_bridge.environment.rewards import REWARDS
from sim_bridge.folders import writing_to
from sim_bridge.learning.checkpoint import SAVE_EVERY_S, RunFolder
from sim_bridge.learning.config import TrainingConfig
from sim_bridge.learning.export import initial_weights
from sim_bridge.learning.presets import PRESETS, preset_named
from sim_bridge.learning.run import Run
from sim_bridge.learning.session import Record, Score, Session
from sim_bridge.maps import add_map_file_options, map_names, route_and_origin

INTERRUPTED = 130


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="train", description=__doc__)
    add = parser.add_argument
    add("--preset", default="paper", help=f"{', '.join(PRESETS)} [%(default)s]")
    add("--reward", default="risk", help=f"{', '.join(REWARDS)} [%(default)s]")
    add("--seed", type=int, default=0, help="decides every random number [%(default)s]")
    add("--steps", type=int, help="environment steps instead of the preset's")
    maps = ", ".join(map_names())
    add(
        "--map",
        default="four_way",
        help=f"own maps ({maps}) by commas, or an .osm file [%(default)s]",
    )
    add_map_file_options(parser)
    add("--scenario", default="base", help="names or .yaml files, by commas [%(default)s]")
    add("--supervisor", default="off", help="off or enforce: take sound actions only [%(default)s]")
    add("--memory", default="instantaneous", help="or tracked: of free space seen [%(default)s]")
    add("--name", help="name of the policy [REWARD_PRESET]")
    add("--out", type=Path, help="output folder [out/training/REWARD_PRESET_seedSEED]")
    return parser.parse_args(argv)


def _config(arguments: argparse.Namespace) -> TrainingConfig:
    config = preset_named(arguments.preset)
    return config if arguments.steps is None else dataclasses.replace(config, steps=arguments.steps)


class _Logs:
    """TensorBoard logs where the package is installed, nothing otherwise."""

    def __init__(self, folder: Path, console: Console) -> None:
        self._writer: Any = None
        try:
            from torch.utils.tensorboard import SummaryWriter  # noqa: PLC0415 (optional)
        except ImportError:
            console.print("no TensorBoard logs: the package tensorboard is not installed")
            return
        self._writer = SummaryWriter(folder)

    def write(self, record: Record) -> None:
        """Log one record."""
        if self._writer is None:
            return
        values = {
            "training/loss": record.loss,
            "training/epsilon": record.epsilon,
            "training/success": record.training_success,
        }
        for kind, score in (("evaluation", record.evaluation), ("validation", record.validation)):
            if score is not None:
                values |= {
                    f"{kind}/{name}": getattr(score, name)
                    for name in ("success", "collision", "timeout", "mean_speed_mps")
                }
        for name, value in values.items():
            self._writer.add_scalar(name, value, record.steps)


def _line(score: Score) -> str:
    return (
        f"success {score.success:.0%} collision {score.collision:.1%} timeout {score.timeout:.0%}"
    )


def _train(session: Session, folder: RunFolder, console: Console) -> None:
    """Train to the end, showing and saving how it goes."""
    steps = session.run_description.config.steps
    columns = (
        TextColumn("{task.percentage:>3.0f}%"),
        BarColumn(bar_width=16),
        TextColumn("{task.description}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    logs = _Logs(folder.path / "tensorboard", console)
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("", total=steps, completed=round(session.progress * steps))
        for record in session.run():
            logs.write(record)
            folder.save(session, every_s=SAVE_EVERY_S)
            progress.update(
                task, completed=min(record.steps, steps), description=_line(record.evaluation)
            )


def main(argv: Sequence[str] | None = None) -> int:
    """Train as the command line says."""
    arguments = _arguments(argv)
    console = Console()
    name = arguments.name or f"{arguments.reward}_{arguments.preset}"
    out = arguments.out or Path("out/training") / f"{name}_seed{arguments.seed}"
    try:
        if Path(name).name != name:
            raise ConfigurationError(f"name is {name!r}, expected one without slashes")
        route, origin = route_and_origin(arguments.route, arguments.origin)
        run = Run(
            config=_config(arguments),
            reward=arguments.reward,
            seed=arguments.seed,
            map_name=arguments.map,
            scenario=arguments.scenario,
            supervisor=arguments.supervisor,
            memory=arguments.memory,
            route=arguments.route,
            origin=arguments.origin,
            projector=arguments.projector,
        )
        places = [Places.named(name, route, origin, run.projector) for name in run.map_names]
        folder = RunFolder(out, run)
        if folder.finished:
            console.print(f"{out} is trained already; delete it to train again")
            return 0
        session = Session(run, places, initial_weights(run.seed, run.outlook_size))
        if folder.resume(session):
            console.print(f"resuming {out} at {session.progress:.0%}")
        with writing_to(out):
            _train(session, folder, console)
            policy = folder.finish(session, name)
    except PlannerError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        console.print("interrupted; the same command goes on from the last checkpoint")
        return INTERRUPTED
    if session.best:
        console.print(f"{policy}: {_line(session.best.score)} on {session.best.score.episodes}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
