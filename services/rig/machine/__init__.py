"""What this machine has and lacks: doctor, real time, ports, the last fault."""
