"""Starting, watching and stopping the services of a rig."""
