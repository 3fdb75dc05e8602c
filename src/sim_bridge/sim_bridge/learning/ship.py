# SPDX-License-Identifier: Apache-2.0
"""Ships a trained policy with the planner: its file, its hash in SHA256SUMS and its model card.

Without a run, only writes the cards anew, for instance after another evaluation. Exit code: 0
done, 2 an option is no good.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from risk_dqn_planner.errors import ConfigurationError, PlannerError
from risk_dqn_planner.policies.shipped import (
    SUMS,
    ShippedPolicy,
    shipped_policies,
    write_sums,
)
from sim_bridge.folders import writing_to
from sim_bridge.learning.checkpoint import POLICY, RESULT
from sim_bridge.learning.model_card import Line, lines_of, write_card
from sim_bridge.learning.origin import origin_of
from sim_bridge.learning.roles import ROLES, role_named

MODELS = Path("src/risk_dqn_planner/models")
RESULTS = Path("out/evaluation/results.json")
MAX_BYTES = 1_000_000


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="ship", description=__doc__)
    add = parser.add_argument
    add("--run", type=Path, help="folder of a finished training run; without: only write cards")
    add("--name", help=f"{', '.join(ROLES)}; without a run: the only card to write [all]")
    add("--results", help=f"results of `evaluate`, several by commas [{RESULTS}]")
    add("--models", type=Path, default=MODELS, help="where policies are shipped [%(default)s]")
    return parser.parse_args(argv)


def read_results(path: Path) -> list[Line]:
    """Return the lines of results.json.

    Raises:
        ConfigurationError: the file is missing, or is none that `evaluate` has written.
    """
    try:
        lines: list[Line] = json.loads(path.read_text(encoding="utf-8"))["cells"]
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigurationError(f"{path} holds no results of `evaluate`") from error
    return lines


def add_policy(run: Path, name: str, models: Path) -> ShippedPolicy:
    """Copy the policy of a finished run to its place and list its hash; the bytes stay the same.

    Raises:
        ConfigurationError: the run is not finished, is none, or is not what the name stands for.
        PolicyFileError: its policy cannot be used.
    """
    role = role_named(name)
    try:
        result = json.loads((run / RESULT).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"{run} holds no finished training run: no {RESULT}") from error
    origin = origin_of(run / POLICY)
    if result["sha256"] != origin.sha256:
        raise ConfigurationError(
            f"{run / POLICY} has SHA-256 {origin.sha256}, expected {result['sha256']} "
            f"as in its {RESULT}"
        )
    role.check(name, origin)
    data = (run / POLICY).read_bytes()
    if len(data) >= MAX_BYTES:
        raise ConfigurationError(f"{run / POLICY} has {len(data)} bytes, expected < {MAX_BYTES}")
    policy = ShippedPolicy(name, models / f"{name}.pt", origin.sha256)
    with writing_to(models):
        policy.path.write_bytes(data)
        listed = shipped_policies(models) if (models / SUMS).is_file() else {}
        write_sums({**listed, name: policy}, models)
    return policy


def _chosen(arguments: argparse.Namespace) -> list[ShippedPolicy]:
    """Return the policies whose cards are to be written, shipping one first if there is a run."""
    if arguments.run is not None:
        if arguments.name is None:
            raise ConfigurationError(f"--name is missing, expected one of: {', '.join(ROLES)}")
        return [add_policy(arguments.run, arguments.name, arguments.models)]
    if not (arguments.models / SUMS).is_file():
        raise ConfigurationError(f"{arguments.models} holds no shipped policies: no {SUMS}")
    listed = shipped_policies(arguments.models)
    if arguments.name is None:
        return list(listed.values())
    if arguments.name not in listed:
        raise ConfigurationError(
            f"{arguments.models} has no policy '{arguments.name}', "
            f"expected one of: {', '.join(listed)}"
        )
    return [listed[arguments.name]]


def _results(arguments: argparse.Namespace) -> list[Line]:
    if arguments.results is not None:
        files = [Path(part) for part in arguments.results.split(",")]
        return [line for file in files for line in read_results(file)]
    if arguments.run is not None and not RESULTS.is_file():
        return []
    return read_results(RESULTS)


def _ship(arguments: argparse.Namespace) -> None:
    lines = _results(arguments)
    # To write cards anew is to write their results anew: those that have none would be lost.
    required = arguments.run is None or arguments.results is not None
    chosen = _chosen(arguments)
    for policy in chosen:
        if required and not lines_of(policy, lines):
            raise ConfigurationError(f"the results have none of {policy.name} ({policy.sha256})")
    for policy in chosen:
        write_card(policy, role_named(policy.name).purpose, origin_of(policy.path), lines)
        evaluated = len(lines_of(policy, lines))
        print(f"{policy.card}: {evaluated} evaluated cells, SHA-256 {policy.sha256}")


def main(argv: Sequence[str] | None = None) -> int:
    """Ship as the command line says."""
    try:
        _ship(_arguments(argv))
    except PlannerError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
