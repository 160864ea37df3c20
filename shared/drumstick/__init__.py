"""The paper as code: stick, contact law, effects, exact solution, parameter table, scenes.

Berdahl, Verplank, Smith and Niemeyer, "A physically intuitive haptic drumstick", ICMC 2007. z points up, the
membrane is at z = 0, the stick is in contact at z < 0. SI units. No I/O: text goes in, arrays and numbers
come out.
"""
