"""The drum that is heard: engine and build, calibration, accuracy tiers and offline rendering."""
