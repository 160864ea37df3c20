"""Sweep of the pulse, return maps, a sound and a sampled arm: what a first script may look like."""

import drumstick as ds

for dv in (0.1, 0.2, 0.4):
    scene = ds.scene("roll", dv_pls=dv)
    print(f"a pulse of {dv} m/s rolls at {ds.simulate(scene, duration_s=10).rate_Hz:.1f} Hz")
    ds.save(ds.analyse(scene).plot(), f"return-map-{dv}.png")
sound = ds.render(ds.scene("roll"), ds.simulate(ds.scene("roll"), duration_s=2))
ds.save(sound, "roll.wav")
print(sound.shape, ds.servo(ds.scene("accents"), duration_s=2))
