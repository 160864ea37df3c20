"""python -m sound_server: play the drums of rigs until told to stop."""

import sys

from sound_server.process import main

if __name__ == "__main__":
    sys.exit(main())
