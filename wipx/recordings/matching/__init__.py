"""Which column of a log is which joint of a robot: by names, and by the forces that the motion needs."""
