"""What is told: location, curves, ties, and the user's own suspicions."""
