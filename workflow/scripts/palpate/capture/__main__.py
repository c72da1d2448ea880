"""``python -m palpate.capture``: the former name of ``palpate check`` and ``palpate import``."""

import sys

from palpate.__main__ import main

if __name__ == "__main__":
    print("python -m palpate.capture: is now called palpate", file=sys.stderr)
    sys.exit(main())
