"""How good the diagnosis is, shown: on blind simulated robots and on real machines, beside other methods."""
