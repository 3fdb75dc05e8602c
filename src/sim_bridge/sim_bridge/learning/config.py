# SPDX-License-Identifier: Apache-2.0
"""All numbers of a training run, grouped by what they govern; presets.py gives them values."""

from dataclasses import dataclass

from risk_dqn_planner.errors import ConfigurationError


def _require(condition: bool, name: str, value: object, expected: str) -> None:
    if not condition:
        raise ConfigurationError(f"{name} is {value}, expected {expected}")


@dataclass(frozen=True)
class ReplayConfig:
    """Prioritised replay (Schaul et al. 2016).

    capacity: transitions kept. alpha: 0 draws uniformly, 1 in full proportion to the TD error.
    beta_start rises linearly to beta_end over the run: how far weights undo the bias of the
    draws. priority_floor: added to |TD error|, so that nothing is never drawn again.
    """

    capacity: int = 50_000
    alpha: float = 0.6
    beta_start: float = 0.4
    beta_end: float = 1.0
    priority_floor: float = 1e-3

    def __post_init__(self) -> None:
        _require(self.capacity >= 1, "ReplayConfig.capacity", self.capacity, "at least 1")
        _require(0.0 <= self.alpha <= 1.0, "ReplayConfig.alpha", self.alpha, "0 to 1")
        _require(
            self.priority_floor > 0.0, "ReplayConfig.priority_floor", self.priority_floor, ">0"
        )
        for name in ("beta_start", "beta_end"):
            value = getattr(self, name)
            _require(0.0 <= value <= 1.0, f"ReplayConfig.{name}", value, "0 to 1")

    def beta(self, progress: float) -> float:
        """Return beta at a share of the run in [0, 1]."""
        return self.beta_start + (self.beta_end - self.beta_start) * progress


@dataclass(frozen=True)
class ExplorationConfig:
    """Epsilon-greedy exploration: from start to end linearly over `share` of the run.

    repeat: probability of a random action to be taken once more, so that the ego does one thing
    for long enough to come into other situations (temporally extended, Dabney et al. 2021).
    """

    start: float = 1.0
    end: float = 0.05
    share: float = 0.25
    repeat: float = 0.0

    def __post_init__(self) -> None:
        for name in ("start", "end", "share", "repeat"):
            value = getattr(self, name)
            _require(0.0 <= value <= 1.0, f"ExplorationConfig.{name}", value, "0 to 1")

    def epsilon(self, progress: float) -> float:
        """Return the probability of a random action at a share of the run in [0, 1]."""
        done = 1.0 if self.share == 0.0 else min(progress / self.share, 1.0)
        return self.start + (self.end - self.start) * done


@dataclass(frozen=True)
class LearnerConfig:
    """Adam on the squared TD error, and how fast the target network follows.

    target_rate: share of the online weights mixed into the target's after each update, the
    paper's "soft target replacement". max_gradient_norm: longer gradients are
    shortened to it; None leaves them alone.
    learning_rate falls linearly to learning_rate_end over the run.
    """

    learning_rate: float = 1e-5
    learning_rate_end: float = 1e-5
    target_rate: float = 0.2
    adam_epsilon: float = 1e-8
    max_gradient_norm: float | None = None

    def __post_init__(self) -> None:
        for name in ("learning_rate", "learning_rate_end", "adam_epsilon", "max_gradient_norm"):
            value = getattr(self, name)
            _require(value is None or value > 0.0, f"LearnerConfig.{name}", value, "above 0")
        _require(
            0.0 < self.target_rate <= 1.0,
            "LearnerConfig.target_rate",
            self.target_rate,
            "in (0, 1]",
        )

    def rate(self, progress: float) -> float:
        """Return the learning rate at a share of the run in [0, 1]."""
        return self.learning_rate + (self.learning_rate_end - self.learning_rate) * progress


@dataclass(frozen=True)
class EvaluationConfig:
    """When the greedy policy is tried, and on how many fixed validation episodes.

    The paper tries 20 episodes every 50 training episodes; every `validation_every`-th time
    the larger set is driven too, and the best policy on it is the one that is exported. It must
    be large: of many policies that collide in 2% of all episodes, the best on 300 has not collided.
    """

    every_episodes: int = 50
    episodes: int = 20
    validation_every: int = 5
    validation_episodes: int = 2_000

    def __post_init__(self) -> None:
        for name in ("every_episodes", "episodes", "validation_every", "validation_episodes"):
            value = getattr(self, name)
            _require(value >= 1, f"EvaluationConfig.{name}", value, "at least 1")


@dataclass(frozen=True)
class AdviceConfig:
    """A slow expert's advice, the look-ahead search's, as one more term of the loss.

    share: of the run in which the expert is asked. until: probability that it drives itself,
    falling from 1 to 0 over this share of the run, before the learner's states are worth asking
    about. capacity, batch_size: of the memory of advice. weight, weight_end: of the term, linear
    over the run. temperature: Q-values that differ by it are told apart. switching_price_s: of the
    search, higher than where it drives itself, so that it teaches calm. alone: nothing is learned
    from rewards, to see what they are worth.
    """

    share: float = 1.0
    until: float = 0.05
    capacity: int = 500_000
    batch_size: int = 256
    weight: float = 1.0
    weight_end: float = 0.0
    temperature: float = 0.1
    switching_price_s: float = 0.5
    alone: bool = False

    def __post_init__(self) -> None:
        for name in ("share", "until"):
            value = getattr(self, name)
            _require(0.0 <= value <= 1.0, f"AdviceConfig.{name}", value, "0 to 1")
        for name in ("capacity", "batch_size"):
            value = getattr(self, name)
            _require(value >= 1, f"AdviceConfig.{name}", value, "at least 1")
        for name in ("weight", "weight_end", "switching_price_s"):
            value = getattr(self, name)
            _require(value >= 0.0, f"AdviceConfig.{name}", value, "0 or more")
        _require(self.temperature > 0.0, "AdviceConfig.temperature", self.temperature, "above 0")

    def weight_at(self, progress: float) -> float:
        """Return the term's weight at a share of the run in [0, 1]."""
        return self.weight + (self.weight_end - self.weight) * progress

    def driving(self, progress: float) -> float:
        """Return the probability that the expert drives at a share of the run in [0, 1]."""
        return 0.0 if progress >= self.until else 1.0 - progress / self.until


@dataclass(frozen=True)
class TrainingConfig:
    """One training run, but for its seed, reward, map and scenario.

    steps: environment steps in all, over the `environments` stepped side by side; every step
    of the whole batch is followed by `updates_per_step` updates of `batch_size` transitions,
    once `warmup_steps` are in the replay. n_step: rewards summed before bootstrapping.
    outlook: whether the network is told more than the paper's state, for training under the
    supervisor. advice: of an expert, None for none.
    """

    preset: str = "paper"
    steps: int = 400_000
    environments: int = 1
    updates_per_step: int = 1
    batch_size: int = 16
    warmup_steps: int = 1_000
    gamma: float = 0.99
    n_step: int = 1
    replay: ReplayConfig = ReplayConfig()
    exploration: ExplorationConfig = ExplorationConfig()
    learner: LearnerConfig = LearnerConfig()
    evaluation: EvaluationConfig = EvaluationConfig()
    outlook: bool = False
    advice: AdviceConfig | None = None

    def __post_init__(self) -> None:
        for name in ("steps", "environments", "updates_per_step", "batch_size", "n_step"):
            value = getattr(self, name)
            _require(value >= 1, f"TrainingConfig.{name}", value, "at least 1")
        _require(0.0 <= self.gamma <= 1.0, "TrainingConfig.gamma", self.gamma, "0 to 1")
        _require(
            self.environments * self.n_step <= self.replay.capacity,
            "TrainingConfig.environments x n_step",
            self.environments * self.n_step,
            f"at most the replay's capacity, {self.replay.capacity}",
        )
        _require(
            1 <= self.warmup_steps <= self.replay.capacity,
            "TrainingConfig.warmup_steps",
            self.warmup_steps,
            f"1 to the replay's capacity, {self.replay.capacity}",
        )
        _require(
            self.advice is None or self.outlook,
            "TrainingConfig.outlook",
            self.outlook,
            "True where there is advice",
        )
