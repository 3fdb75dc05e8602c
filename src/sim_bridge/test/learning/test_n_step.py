# SPDX-License-Identifier: Apache-2.0
import numpy as np

from sim_bridge.learning.n_step import NStepReturns
from sim_bridge.learning.replay import Transitions

GAMMA = 0.5


def one_step(number: int, reward: float, discount: float = 1.0) -> Transitions:
    """Step `number` of one environment, from state [number] to [number + 1]."""
    return Transitions(
        s_tm1=np.array([[number]], dtype=np.float32),
        a_tm1=np.array([number]),
        r_t=np.array([reward], dtype=np.float32),
        discount_t=np.array([discount], dtype=np.float32),
        s_t=np.array([[number + 1]], dtype=np.float32),
        sound_t=np.array([[True, number % 2 == 0, False]]),
    )


def push(returns: NStepReturns, step: Transitions, ended: bool = False) -> list[tuple[float, ...]]:
    """Return completed transitions as (s, a, r, discount, s')."""
    *out, _ = returns.push(step, np.array([True]), np.array([ended]))
    return [
        (float(s[0]), int(a), float(r), float(d), float(n[0]))
        for s, a, r, d, n in zip(*out, strict=True)
    ]


def test_one_step_only_applies_gamma() -> None:
    returns = NStepReturns(1, 1, GAMMA, 1)
    assert push(returns, one_step(0, 8.0)) == [(0, 0, 8.0, 0.5, 1)]
    assert push(returns, one_step(1, 4.0, discount=0.0), ended=True) == [(1, 1, 4.0, 0.0, 2)]


def test_three_steps_sum_discounted_rewards() -> None:
    returns = NStepReturns(1, 3, GAMMA, 1)
    assert push(returns, one_step(0, 8.0)) == []
    assert push(returns, one_step(1, 4.0)) == []
    # 8 + 4/2 + 2/4 = 10.5, then 4 + 2/2 + 1/4 = 5.25; the bootstrap counts gamma^3.
    assert push(returns, one_step(2, 2.0)) == [(0, 0, 10.5, 0.125, 3)]
    assert push(returns, one_step(3, 1.0)) == [(1, 1, 5.25, 0.125, 4)]


def test_termination_hands_out_the_rest_and_does_not_bootstrap() -> None:
    returns = NStepReturns(1, 3, GAMMA, 1)
    push(returns, one_step(0, 8.0))
    assert push(returns, one_step(1, 4.0, discount=0.0), ended=True) == [
        (0, 0, 10.0, 0.0, 2),
        (1, 1, 4.0, 0.0, 2),
    ]


def test_truncation_hands_out_the_rest_and_bootstraps_over_the_steps_made() -> None:
    returns = NStepReturns(1, 3, GAMMA, 1)
    push(returns, one_step(0, 8.0))
    assert push(returns, one_step(1, 4.0), ended=True) == [
        (0, 0, 10.0, 0.25, 2),
        (1, 1, 4.0, 0.5, 2),
    ]


def test_no_reward_crosses_an_episode_boundary() -> None:
    returns = NStepReturns(1, 2, GAMMA, 1)
    push(returns, one_step(0, 8.0), ended=True)
    assert push(returns, one_step(10, 4.0)) == []
    assert push(returns, one_step(11, 2.0)) == [(10, 10, 5.0, 0.25, 12)]


def test_environments_do_not_mix() -> None:
    random = np.random.default_rng(0)
    together = NStepReturns(3, 2, GAMMA, 1)
    apart = [NStepReturns(1, 2, GAMMA, 1) for _ in range(3)]
    for number in range(20):
        rewards = random.random(3)
        ended = random.random(3) < 0.3
        step = Transitions(
            *(
                np.concatenate(fields)
                for fields in zip(*(one_step(number, r) for r in rewards), strict=True)
            )
        )
        expected = [
            row
            for returns, r, end in zip(apart, rewards, ended, strict=True)
            for row in push(returns, one_step(number, r), bool(end))
        ]
        out = together.push(step, np.ones(3, dtype=np.bool_), ended)
        assert [float(r) for r in out.r_t] == [row[2] for row in expected]
        assert [float(d) for d in out.discount_t] == [row[3] for row in expected]


def test_a_step_that_was_not_taken_leaves_no_trace() -> None:
    returns = NStepReturns(1, 2, GAMMA, 1)
    push(returns, one_step(0, 8.0))
    out = returns.push(one_step(7, 99.0), np.array([False]), np.array([True]))
    assert len(out.r_t) == 0
    assert push(returns, one_step(1, 4.0)) == [(0, 0, 10.0, 0.25, 2)]


def test_what_is_sound_goes_with_the_state_that_was_reached() -> None:
    returns = NStepReturns(1, 3, GAMMA, 1)
    taken, ended = np.array([True]), np.array([True])
    for number in range(2):
        returns.push(one_step(number, 1.0), taken, ~ended)
    # Step 2 reaches state 3, in which 0 and 1 are sound; so it is said of all that end there.
    out = returns.push(one_step(2, 1.0), taken, ended)
    assert out.sound_t.tolist() == [[True, True, False]] * 3


def test_restored_sums_go_on_identically() -> None:
    returns = NStepReturns(1, 3, GAMMA, 1)
    push(returns, one_step(0, 8.0))
    push(returns, one_step(1, 4.0))
    restored = NStepReturns(1, 3, GAMMA, 1)
    restored.load_state_dict(returns.state_dict())
    assert push(restored, one_step(2, 2.0)) == [(0, 0, 10.5, 0.125, 3)]
