"""The gateway: speaks Zenoh and OSC for the servo, and is the first fence for parameters. It may die at any time."""
