"""How long and how fast a network is trained, without PyTorch."""

from dataclasses import dataclass

from wipx.core.errors import InputError, check_positive


@dataclass(frozen=True)
class TrainingPlan:
    """Settings of a training.

    Attributes:
        epochs: At most.
        patience: Epochs without progress on robots that are not learned from, after which training stops.
        batch: Windows per step.
        learning_rate: Of Adam, at the start.
        weight_decay: Of Adam.
        annealed: Whether the learning rate falls to zero along half a cosine over `epochs`; constant if not.
        seconds: Budget, looked at after every epoch; a training that it ends is not repeatable.
    """

    epochs: int
    patience: int
    batch: int
    learning_rate: float
    weight_decay: float
    annealed: bool
    seconds: float

    def __post_init__(self) -> None:
        check_positive(
            **{
                "estimator.epochs": self.epochs,
                "estimator.patience": self.patience,
                "estimator.batch": self.batch,
                "estimator.learning_rate": self.learning_rate,
                "estimator.seconds": self.seconds,
            }
        )
        if not self.weight_decay >= 0.0:
            raise InputError(f"estimator.weight_decay is {self.weight_decay:g}, expected zero or more")
