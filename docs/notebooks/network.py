# %% [markdown]
"""
# OSC and Zenoh from Python into your own patch

For musicians and students who want the drumstick to play something of their own: a sampler, a light, a
sonification. This notebook starts a rig with the simulated stick, hears its strikes in two ways, changes the
roll while it plays, reads back what came of it, and turns the strikes into a sound of your own. At the end it
stops what it started.

**OSC** is for patches and DAWs: small messages over UDP, no connection. **Zenoh** is for programs that want
more: a question gets an answer, a subscriber gets everything. Addresses and payloads: `docs/osc.md`,
`docs/zenoh.md`.
"""

# %%
import atexit
import json
import os
import queue
import random
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import matplotlib.pyplot as plt
import msgspec
import numpy as np
import zenoh
from pythonosc.dispatcher import Dispatcher
from pythonosc.osc_server import ThreadingOSCUDPServer
from pythonosc.udp_client import SimpleUDPClient

import drumstick as ds

PATIENCE_S = 200.0  # for what must come; the first start on a machine compiles

# %% [markdown]
"""
## An ear for OSC

The rig will send to a port of ours. Whatever comes goes into one queue for each address, so that we can wait
for it.
"""

# %%
heard: dict[str, queue.SimpleQueue[tuple]] = {}
lock = threading.Lock()


def messages(address: str) -> queue.SimpleQueue[tuple]:
    with lock:
        return heard.setdefault(address, queue.SimpleQueue())


def wait_for(address: str) -> tuple:
    return messages(f"/drumstick/{address}").get(timeout=PATIENCE_S)


dispatcher = Dispatcher()
dispatcher.set_default_handler(lambda address, *values: messages(address).put(values))
ear = ThreadingOSCUDPServer(("127.0.0.1", 0), dispatcher)  # 0: any free port
threading.Thread(target=ear.serve_forever, daemon=True).start()

# %% [markdown]
"""
## Start a rig

In a terminal you would type `drumstick up` and have sound, page and all at the usual ports. Here only the force
loop and its gateway start, under a name and at ports of their own, so that no rig that runs on this machine is
disturbed. For a rig that runs already: leave out this cell and the last `stop()`, set `osc_in = 9100`,
`endpoint = "tcp/127.0.0.1:7447"` and `rig = "main"`, and let the ear listen at `9101`.
"""

# %%
rig, osc_in, zenoh_port = f"notebook-{random.randrange(10**6)}", *random.sample(range(12_000, 32_000), 2)
endpoint = f"tcp/127.0.0.1:{zenoh_port}"
place = tempfile.TemporaryDirectory()  # its presets and run-time files
process = subprocess.Popen(
    [
        *(Path(sys.executable).with_name("drumstick"), "haptic", "--scene", "roll", "--rig", rig),
        *("--listen", endpoint, "--osc-in", str(osc_in), "--osc-out", f"127.0.0.1:{ear.server_address[1]}"),
    ],
    env={**os.environ, "XDG_STATE_HOME": place.name, "XDG_RUNTIME_DIR": place.name},
    stdout=subprocess.DEVNULL,  # its summary; what goes wrong it tells on stderr
)


def stop() -> None:
    """End the rig and close what is open; again is harmless."""
    process.terminate()
    process.wait(30.0)
    ear.shutdown()
    ear.server_close()
    place.cleanup()


atexit.register(stop)  # also when a cell fails

print("alive:", wait_for("alive")[0] == rig)
# > alive: True

# %% [markdown]
"""
## Strikes by OSC

`/drumstick/strike` has the number of the strike, where it fell (x, y in parts of the radius), the speed in m/s,
the level 0 to 1, and the peak force to expect in N.
"""

# %%
by_osc = [wait_for("strike") for _ in range(20)]
number, x, y, speed, level, force = by_osc[-1]
print(f"strikes one after the other: {[strike[0] - by_osc[0][0] for strike in by_osc] == list(range(20))}")
# > strikes one after the other: True
print(f"speed {speed:.1f} m/s, level {level:.1f}, on a circle of {np.hypot(x, y):.2f} radii")
# > speed 0.6 m/s, level 0.3, on a circle of 0.45 radii

# %% [markdown]
"""
## Turn a knob, and read it back

A value that we set is taken over while the stick is above the head. The rig then sends what is in use: that is
the *readback*, and only it counts. What would be too much is refused in words, and nothing changes.
"""

# %%
to_rig = SimpleUDPClient("127.0.0.1", osc_in)
to_rig.send_message("/drumstick/param/dv_pls", 0.3)
print(f"dv_pls is now {wait_for('param/dv_pls')[0]:.2f} m/s")
# > dv_pls is now 0.30 m/s

to_rig.send_message("/drumstick/param/dv_pls", 99.0)
print(*wait_for("error"))
# > /drumstick/param/dv_pls dv_pls: 99 m/s is outside 0 .. 10 m/s

# %% [markdown]
"""
## The same by Zenoh

A session, a subscriber, a question. What the rig sends is MessagePack: lists whose first element is the version
of the protocol. What we send may be JSON.
"""

# %%
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([endpoint]))
session = zenoh.open(config)
atexit.register(session.close)

by_zenoh: queue.SimpleQueue[list] = queue.SimpleQueue()
subscriber = session.declare_subscriber(
    f"drumstick/{rig}/strike",
    lambda sample: by_zenoh.put(msgspec.msgpack.decode(sample.payload.to_bytes())),
)


def ask(key: str, payload: object = None) -> list:
    """The answer to a question; RuntimeError with the reason of a refusal."""
    told = None if payload is None else json.dumps(payload)
    (reply,) = session.get(f"drumstick/{rig}/{key}", payload=told, timeout=PATIENCE_S)
    if reply.ok is None:
        raise RuntimeError(msgspec.msgpack.decode(reply.err.payload.to_bytes())[1])
    return msgspec.msgpack.decode(reply.ok.payload.to_bytes())


version, k_hand, revision, pending = ask("set/k_hand", 30.0)
print(f"k_hand will be {k_hand} N/m")
# > k_hand will be 30.0 N/m
try:
    ask("set/k_hand", -5.0)
except RuntimeError as refusal:
    print(refusal)
# > k_hand: -5 N/m is outside 0 .. 10000 N/m
print(f"dv_pls, as set by OSC: {ask('param/dv_pls')[1]:.2f} m/s")
# > dv_pls, as set by OSC: 0.30 m/s

# %% [markdown]
"""
Both ways tell of the same strikes, by the same number:
"""

# %%
version, boot, seq, t_ns, x, y, speed, level, *rest = by_zenoh.get(timeout=PATIENCE_S)
same = next(strike for strike in iter(lambda: wait_for("strike"), None) if strike[0] == seq)
print(f"the same strike: speed {np.isclose(same[3], speed)}, level {np.isclose(same[4], level)}")
# > the same strike: speed True, level True

# %% [markdown]
"""
## Play the drum yourself

`/drumstick/play/strike` strikes without the stick: x, y, level. It comes back with a negative number, so that a
patch that answers strikes with strikes can tell its own.
"""

# %%
to_rig.send_message("/drumstick/play/strike", [0.3, 0.0, 0.8])
mine = next(strike for strike in iter(lambda: wait_for("strike"), None) if strike[0] < 0)
print(f"mine has the number {mine[0]}, level {mine[4]:.2f}")
# > mine has the number -1, level 0.80

# %% [markdown]
"""
## Your own patch

Two seconds of strikes become two seconds of a sound that is no drum. Zenoh's strikes carry the time at which
the servo saw the contact, to the nanosecond, so the rhythm is the stick's and not that of the network. Let the
level set loudness and brightness, and the place the pitch. Live you would start a note in your synthesizer
instead of adding to an array.
"""

# %%
RATE_HZ, SECONDS = 48_000, 2.0
while not by_zenoh.empty():
    by_zenoh.get()
played = [by_zenoh.get(timeout=PATIENCE_S)]
while played[-1][3] - played[0][3] < 1e9 * SECONDS:
    played.append(by_zenoh.get(timeout=PATIENCE_S))

samples = np.zeros(round((SECONDS + 1.5) * RATE_HZ), np.float32)
note_s = np.arange(RATE_HZ) / RATE_HZ
times_s, levels = [], []
for strike in played:
    t_ns, x, y, level = strike[3], strike[4], strike[5], strike[7]
    begin_s = (t_ns - played[0][3]) * 1e-9
    pitch_Hz = 440.0 * 2.0 ** (np.arctan2(y, x) / np.pi)  # an octave up or down, once around
    note = np.sin(
        2 * np.pi * pitch_Hz * note_s
        + 3 * level * np.sin(6 * np.pi * pitch_Hz * note_s) * np.exp(-20 * note_s)
    )
    first = round(begin_s * RATE_HZ)
    samples[first : first + RATE_HZ] += 0.3 * level * np.exp(-6 * note_s) * note
    times_s.append(begin_s)
    levels.append(level)

print(f"{len(played)} strikes, one every {1e3 * np.median(np.diff(times_s)):.0f} ms")
# > ... strikes, one every ... ms

figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
above.stem(times_s, levels, basefmt=" ")
above.set(ylabel="level", ylim=(0.0, 1.0), title="Strikes heard by Zenoh, and what we made of them")
below.plot(np.arange(len(samples)) / RATE_HZ, samples, linewidth=0.3)
below.set(xlabel="time, s", ylabel="sample")

plt.show()

sound = samples.view(ds.Sound)  # a notebook shows a player
sound

# %% [markdown]
"""
## The end

Stop what was started. If you forget, the end of the notebook's kernel does it.

For Pure Data, SuperCollider, Max and DAWs there are files to start from: `docs/daw/README.md`.
"""

# %%
session.close()
stop()
print("the rig ended with", process.returncode)
# > the rig ended with 0
