"""Real-to-sim adaptation."""
