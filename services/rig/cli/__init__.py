"""What each command of `drumstick` is given and calls. Nothing heavy is imported before a command runs."""
