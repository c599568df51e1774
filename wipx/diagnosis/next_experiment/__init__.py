"""What to record next: excitations, simulated, and the one that tells most."""
