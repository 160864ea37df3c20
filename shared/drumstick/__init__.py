"""The paper as code: stick, drum, effects, exact motion, bounds, analysis, parameter table, scenes.

Berdahl, Verplank, Smith and Niemeyer, "A physically intuitive haptic drumstick", ICMC 2007. z points up, the
membrane is at z = 0, the stick is in contact at z < 0. SI units. No I/O: text goes in, arrays and numbers
come out.

| room | holds |
|---|---|
| `parameters` | declarations with ranges and units, TOML, scenes, the table of what can be set live |
| `stick` | contact law, effects, exact motion, fixed steps, simulation |
| `drum` | membrane, modes, excitation, drum effects, output; engine, calibration, accuracy, offline rendering |
| `safety` | bounds, the joint envelope, the fence: which sets are accepted, and the reason for a refusal |
| `analysis` | return map, cycles and multipliers, capture, predictions |
"""
