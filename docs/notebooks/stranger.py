"""Sweep of the pulse, a return map, a sound and a sampled arm: what a first script may look like."""

import matplotlib.pyplot as plt

import drumstick as ds

for dv in (0.1, 0.2, 0.4):
    run = ds.simulate(ds.scene("roll", dv_pls=dv), duration_s=10)
    plt.plot(run.contacts["v_e_m_per_s"][:-1], run.contacts["v_e_m_per_s"][1:], ".", label=f"{dv} m/s")
    print(f"a pulse of {dv} m/s rolls at {run.rate_Hz:.1f} Hz")
plt.gca().set(xlabel="speed after a contact, m/s", ylabel="after the next, m/s", title="Return map")
plt.legend()
plt.savefig("return-map.png")
sound = ds.render(ds.scene("roll"), ds.simulate(ds.scene("roll"), duration_s=2))
print(sound.shape, ds.servo(ds.scene("accents"), duration_s=2))
