"""Long-run behaviour of a scene's exact motion, beside the predictions of the paper's equations.

| file | noun |
|---|---|
| `findings` | everything about one scene: `analyse(scene)`, what `drumstick analyse` tells |
| `flight`, `rebound` | alpha of one flight; beta of one contact, and the capture speed |
| `gain`, `predictions`, `speeds` | kappa in closed form; v_lc by equation (7) and by kappa; both over dv |
| `grips` | each grip of a hand that changes while it plays, held still |
| `inverse`, `ramp` | values for a roll of a wanted rate and level; values on the way there |
| `cycles.return_step` | the compiled kernels: from one release of the stick to the next |
| `cycles`: `return_map`, `search`, `cycle`, `multiplier`, `fixed_points` | every cycle, stable or not |
| `ends`, `cycles.basins` | which strike leads to which roll or rest, where they part, what breaks a roll |
| `cycles`: `settling`, `sweep` | what a throw ends in, for one scene and over one or two parameters |
| `unpulsed` | a scene without its pulses |
"""
