"""How likely recordings are under a hypothesis: the recordings, the observer, noise, fits, their uncertainty."""
