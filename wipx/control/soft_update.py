"""The paper's soft update of a reference (Eq. 9)."""

from wipx.core.errors import InputError, check_positive

PAPER_RATE = 650.0  # [Hz] of the loop for which the paper's alpha is meant (600 to 700, Sec. V-A)


class SoftUpdate:
    """A reference that moves to its target with bounded speed, smoothed.

    The paper prints theta_des = max(theta_lin, -beta t), theta_sm = alpha theta_des + (1 - alpha) theta_sm, for a
    negative theta_lin and steps of one controller. Here the first is mirrored for a positive target, and begins when
    there is one, wherever the reference is; the second is the first-order lag that equals it at 650 Hz, so that it does
    not depend on the rate.

    Args:
        alpha: Share of the new reference per 1/650 s.
        beta: Speed [rad/s].

    Raises:
        InputError: alpha is not between 0 and 1, or beta not positive.
    """

    def __init__(self, alpha: float, beta: float) -> None:
        if not 0.0 < alpha <= 1.0:
            raise InputError(f"controller.alpha is {alpha:g}, expected a number above 0, at most 1 (no smoothing)")
        check_positive(beta=beta)
        self._alpha, self._beta = alpha, beta
        self.reset()

    def reset(self) -> None:
        """Begin at zero."""
        self.desired = self.smooth = 0.0

    def advance(self, target: float, duration: float) -> None:
        """Let a time [s] pass, with a target [rad]."""
        reach = self._beta * duration
        self.desired += min(max(target - self.desired, -reach), reach)
        kept = (1.0 - self._alpha) ** (duration * PAPER_RATE)
        self.smooth = kept * self.smooth + (1.0 - kept) * self.desired
