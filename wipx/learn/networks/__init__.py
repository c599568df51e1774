"""One module for each network that estimates the equilibrium pitch; its class is the `_target_` of an option."""
