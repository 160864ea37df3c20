"""OSC over UDP: what DAWs, Pd, SuperCollider and touch screens hear and may say."""
