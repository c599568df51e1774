"""Runs on their way to MLflow: what is noted of each in its folder, whether MLflow can be reached, logging."""
