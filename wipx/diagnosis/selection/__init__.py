"""Which effects are missing together: the search, and laws that contain each other."""
