"""The public listener, in a process of its own: what comes in from a network never touches the gateway's own router."""
