"""Tasks that make tables and figures of finished sweeps."""
