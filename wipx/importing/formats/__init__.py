"""One module per format of logs; each has a `LogFormat`."""
