"""Writes docs/recordings.md from the code's channels and the stored sizes: drumstick lab recordings-page."""

from drumstick_lab.checkout import DOCS
from drumstick_lab.measuring.provenance import heading
from drumstick_lab.measuring.stored import read
from rig.recording.channels import CHANNELS, FORMAT, Channel, schema, schema_name
from rig.recording.mcap_writer import CHUNK_BYTES, CHUNK_NS, CLOCK_METADATA, METADATA, SCENE_ATTACHMENT

PAGE = DOCS / "recordings.md"

_WHEN = {
    "/strike": "at each strike",
    "/release": "at each release",
    "/choke": "each time",
    "/contact": "with `--force`, of a scene that streams: every 2 ms of a contact",
    "/state": "30 times a second",
    "/meter": "10 times a second, of each sound server",
    "/param": "at the start, and at each accepted change",
    "/alive": "when a service comes or goes",
}
_ROWS = {
    "without": "`roll` with a sound server",
    "with": "the same with `--force`",
}

_COMMANDS = f"""\
# Recordings

Made by `drumstick lab recordings-page` from the code and the stored sizes; do not edit.

What a rig does, as an [MCAP](https://mcap.dev) file: every strike, release and parameter, the state, the meters, who
came and went, and if you want it the force of each contact. It can be looked at in Foxglove or PlotJuggler, played
again over Zenoh and OSC, and rendered.

```sh
drumstick record --out take.mcap                # a rig that runs, until Ctrl-C
drumstick record --out take.mcap --duration 60 --force
drumstick up --record take.mcap                 # from the start, as long as the rig runs; also drumstick haptic
drumstick replay take.mcap                      # on the wires again, in the haptic server's place
drumstick render roll --strikes take.mcap --out take.wav
```

## Recording

The recorder is a program of its own. For a rig on another machine give it `--rig-file listener/rig.toml`
([security.md](security.md)); where the network has an open router of its own, `--connect`. Whatever happens to the
recorder, the rig plays on. It says what it could not get: strikes that never came, messages that came faster than the disk
took them. A file that exists is never overwritten.

- `--force` (`--record-force` with `up`) records the contact's force, tick by tick. Only a scene with `[drum]
  excitation = "streamed"` has that, and the rig tells it only while somebody listens: this makes it do so. The
  certificate `listener` is not given it, so over TLS there is none.
- `--rig NAME` says which rig, `--json` prints what was recorded as one JSON object.
- Exit status 2: the file exists, or the scene does not stream; 3: no rig answers, or the disk took no more.

| what ends it | what is left |
|---|---|
| Ctrl-C, SIGTERM, `--duration`, the end of `drumstick up` | a whole file with its index |
| kill -9, a crash | all but the last chunk (at most {CHUNK_NS / 1e9:g} s, or {CHUNK_BYTES // 1024} KiB before compression); no index |
| a power cut | the same: each chunk is flushed to the disk (fsync) when it is {CHUNK_NS / 1e9:g} s old or full |
| a full disk, a write error | the same; one line, exit status 3; the rig plays on and the recorder is not started again |
| a byte that the disk spoilt | what stands before the chunk that it is in (each has a checksum) |

A recorder of `drumstick up --record take.mcap` that was killed starts again and goes on in `take-2.mcap`. A file
without an index can be replayed and rendered as it is; `mcap recover` (of the MCAP command line tool, not tried here) gives it one,
for programs that insist.

## Replaying

`drumstick replay take.mcap` stands in for the haptic server: it is the Zenoh router at `--listen` (or a client, with
`--connect`), answers `scene`, `clock`, `param` and `doctor`, is present as `alive/haptic/ID`, and publishes strikes,
releases, forces, states and readbacks with the recorded timing, as one new start of a servo, in this machine's time.
Sound servers and panels need not know. OSC goes to `--osc-out` as from a live rig: strikes, releases, their mirrors,
readbacks, `alive`.

- It begins a second after its start; `--await-sound` lets it wait for a sound server first, so that none of its
  strikes is missed.
- `--speed 2` plays twice as fast; each contact keeps its own length. `--loop` begins again one usual interval between
  strikes after the last message.
- `set` is refused with a reason; `panic` ends it. It will not play beside a live rig of the same `--rig` name on the
  same router.
- Each message has an absolute deadline; how late they went out is printed at the end.
- What would play for more than an hour is refused, with its length and its longest silence: one wrong time can make it last for years.
  `--longest SECONDS` allows more. Refused too are messages with impossible times: those that go back, and those that
  happened after they were recorded or more than an hour before.
- A file that was cut off is played to its last whole chunk, which is said. A recording across a change of scene is
  played with the first one.

## Rendering

`drumstick render SCENE --strikes take.mcap` plays the recorded strikes on the drum of SCENE, with the peak force
and contact time that each strike announced, as the live sound server does; for a SCENE that streams, the recorded
forces instead (without any it says what to do). The first strike falls 0.05 s into the file; without `--duration` all of the
recording is rendered, and a second to ring; one that lasts for more than an hour only with `--duration`. What the disk
has no room for, or a WAV file (4.29 GB), is refused before anything is written.

`--stems FOLDER` also writes each pickup or microphone of SCENE into a file of its own, `pickup-1.wav`, `microphone-1.wav`
..., and into `rest.wav` what sounds besides the head (a hoop). These *stems* are panned as in the mix, 32-bit float, without a
limiter: their sum is the mix before its limiter. So you can mix a take again.

## What is in the file

One channel for each topic, messages as JSON (`json`) with a JSON schema (`jsonschema`); chunks are compressed with
zstd. `log_time` is when the recorder heard a message, `publish_time` when it happened, both in ns of the recorder's
wall clock as it stood at the start, counted on by its monotonic clock. `t_ns` in a message is the haptic machine's
own clock; round trips of `clock` map it, and a new measurement replaces the old one only where the two contradict
each other. An event of a servo whose clock is not known yet has the time of its arrival.

Metadata record `{METADATA}`: format (this is format {FORMAT}), rig, boot, versions of everything, the start in wall
and monotonic ns, and the clocks' offsets. `{CLOCK_METADATA}`: each later mapping. Attachment `{SCENE_ATTACHMENT}`:
the scene with every default written out; `scene-BOOT.json`: one that replaced it.
"""

_VIEWERS = """\
## Looking at it

Both programs read the JSON and its schema as they are, by their documentation; neither was tried here.

- **Foxglove**: *Open local file*, choose `take.mcap`, add a *Plot* panel and give message paths such as
  `/strike.z_speed_m_per_s`, `/state.roll_rate_Hz` or `/param/dv_pls.value`. The *Raw Messages* panel shows `/alive`.
- **PlotJuggler**: load the file, choose the topics; series are named `/strike/level`, `/state/z_m` ... The forces of
  `/contact` become one series for each place in the array.
- **Python**: `mcap.reader.make_reader(open("take.mcap", "rb")).iter_messages(topics="/strike")`, then
  `json.loads(message.data)`. For one that was cut off: `NonSeekingReader`, `log_time_order=False`, until it raises
  `EndOfFile`.

JavaScript keeps whole numbers exact to 2^53 only: after 104 days without a restart of the machine, `t_ns` is shown to
2 ns there.
"""


def _topic(channel: Channel) -> str:
    return f"`{channel.topic}/NAME`" if channel.many else f"`{channel.topic}`"


def _channels() -> list[str]:
    rows = ["| topic | schema | when | what |", "|---|---|---|---|"]
    rows += [
        f"| {_topic(each)} | `{schema_name(each)}` | {_WHEN[each.topic]} | {each.words} |"
        for each in CHANNELS
    ]
    return rows


def _fields() -> list[str]:
    rows = ["| topic | field | type | what |", "|---|---|---|---|"]
    for channel in CHANNELS:
        described = schema(channel)
        for name, row in described["properties"].items():
            kind = f"array of {row['items']['type']}" if row["type"] == "array" else row["type"]
            kind += "" if name in described["required"] else ", may be left out"
            rows.append(f"| {_topic(channel)} | `{name}` | {kind} | {row['description']} |")
    return rows


def _sizes() -> list[str]:
    found = read("recording_size")
    rows = [
        *heading("## How large", "recording_size"),
        f"`drumstick lab recording-size`, {found['seconds']:g} s each.",
        "",
        "| what | kB a minute | messages a second | the recorder's share of a core |",
        "|---|---|---|---|",
    ]
    for name, row in found["rows"].items():
        rates = ", ".join(f"{rate:.0f} {topic}" for topic, rate in row["messages_per_s"].items())
        rows.append(f"| {_ROWS[name]} | {row['kB_per_minute']:.0f} | {rates} | {row['share_of_core']:.1%} |")
    return rows


def page() -> str:
    """The whole page."""
    parts = [
        _COMMANDS,
        "\n".join(_channels()),
        "",
        "\n".join(_fields()),
        "",
        "\n".join(_sizes()),
        "",
        _VIEWERS,
    ]
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
