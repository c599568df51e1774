"""The rigid body of any open tree, as code that is written out for each robot."""
