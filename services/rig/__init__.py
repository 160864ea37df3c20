"""The `drumstick` command: starts the services as processes, watches them, and computes offline."""
