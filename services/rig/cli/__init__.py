"""Arguments and calls of each `drumstick` command. Nothing heavy is imported before a command runs."""
