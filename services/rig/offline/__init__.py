"""Commands that need no rig: simulate, analyse, render, scene cost."""
