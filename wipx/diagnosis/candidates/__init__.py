"""What could be missing: every effect screened, with first guesses of its numbers."""
