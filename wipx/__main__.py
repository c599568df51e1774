"""`python -m wipx`."""

import sys

from wipx.app import main

if __name__ == "__main__":
    sys.exit(main())
