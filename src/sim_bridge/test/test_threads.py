# SPDX-License-Identifier: Apache-2.0
from collections.abc import Iterator
from pathlib import Path

import pytest
import torch

from sim_bridge.evaluation import evaluate
from sim_bridge.learning import ablation
from sim_bridge.threads import compute_on_one_thread


@pytest.fixture(autouse=True)
def two_threads() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    yield
    torch.set_num_threads(before)


def test_commands_that_may_run_side_by_side_take_one_thread_each(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    nothing = ["--scenarios", "nowhere", "--output", str(tmp_path)]
    for command in (lambda: evaluate.main(nothing), lambda: ablation.main(["--variants", "none"])):
        torch.set_num_threads(2)
        assert command() == 2
        assert torch.get_num_threads() == 1


def test_who_asks_for_more_threads_gets_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    compute_on_one_thread()
    assert torch.get_num_threads() == 2
