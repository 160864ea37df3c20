"""python -m sound_server: play the drums of rigs until told to stop."""

from realtime.log import end_process
from sound_server.process import main

if __name__ == "__main__":
    end_process(main())
