"""The rig as the panel knows it: its session, its state, subscriptions and queries."""
