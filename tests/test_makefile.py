# SPDX-License-Identifier: Apache-2.0
"""Variables that a target does not take are refused, and its help line names those it takes."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MAKEFILE = (ROOT / "Makefile").read_text("utf-8")
TARGETS = dict(re.findall(r"^([a-z]+):(?: [a-z ]+)? ## (.*)$", MAKEFILE, re.MULTILINE))


def make(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = ["make", "-n", "-C", str(ROOT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def option_names(text: str) -> set[str]:
    return set(re.findall(r"\$\(call option,--[a-z]+,([A-Z]+)\)", text))


RUN_OPTIONS = option_names(MAKEFILE[MAKEFILE.index("RUN_OPTIONS =") : MAKEFILE.index("GIVEN :=")])


@pytest.mark.parametrize("target", sorted(set(TARGETS) - {"soak"}))
def test_the_help_line_names_every_option_that_the_recipe_passes(target: str) -> None:
    recipe = MAKEFILE[MAKEFILE.index(f"\n{target}:") :].split("\n\n")[0].split("##", 1)[1]
    help_line, _, rest = recipe.partition("\n")
    passed = option_names(rest) | (RUN_OPTIONS if "$(RUN_OPTIONS)" in rest else set())
    assert passed <= set(re.findall(r"[A-Z]{2,}", help_line))


@pytest.mark.parametrize(
    "given", [("evaluate", "POLICY=tuned"), ("demo", "SUPERVISR=off"), ("lint", "MAP=four_way")]
)
def test_a_variable_that_a_target_does_not_take_is_named(given: tuple[str, str]) -> None:
    done = make(*given)
    assert done.returncode == 2
    assert f"make {given[0]} takes no {given[1].split('=')[0]}, but:" in done.stderr


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (("demo", "SUPERVISOR=off"), "--supervisor='off'"),
        (("bags", "UPDATE=1"), "update_bags"),
        (("bags", "UPDATE=0"), "record"),
        (("test", "ARGS=-k nothing"), "-k nothing"),
    ],
)
def test_what_a_target_takes_reaches_its_command(given: tuple[str, str], expected: str) -> None:
    assert expected in make(*given).stdout
