"""What several tasks need: the job, its progress, trials, adapted simulations, scenarios, stages."""
