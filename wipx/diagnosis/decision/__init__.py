"""What counts: which evidence, what is confirmed, intervals, and recordings that cannot be right."""
