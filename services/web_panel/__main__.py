"""python -m web_panel: serve the technician's page of one rig on 127.0.0.1 until told to stop."""

from realtime.log import end_process
from web_panel.process import main

if __name__ == "__main__":
    end_process(main())
